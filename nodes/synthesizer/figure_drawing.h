#pragma once
#include <optional>
#include <vector>

#include "nodes/synthesizer/director.h"
#include "proto/foxglove/scene.pb.h"

namespace mimesis::synthesizer {

/// Figures for viewers: rods and heads of a few, lines of many. Robots draw themselves.
class FigureDrawing {
 public:
  /// Empty if the director's rows are not those of a body, or it leads a robot.
  static std::optional<FigureDrawing> of(const Director& director);

  /// All in one entity, in W.
  foxglove::SceneUpdate draw(const Director& director, std::chrono::nanoseconds now) const;

 private:
  FigureDrawing() = default;

  std::vector<int> body_row_;  ///< by row of the model
};

}  // namespace mimesis::synthesizer
