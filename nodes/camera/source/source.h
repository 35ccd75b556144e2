#pragma once
#include <chrono>
#include <optional>
#include <string>

#include "common/image/image.h"

namespace mimesis::camera {

struct Frame {
  const image::Image* image;       ///< valid until the next call
  std::chrono::nanoseconds stamp;  ///< capture, on the graph's clock
};

/// Where images come from.
class Source {
 public:
  virtual ~Source() = default;
  /// Newest frame captured up to `now` (graph time) that was not returned before. Does not wait.
  virtual std::optional<Frame> next(std::chrono::nanoseconds now) = 0;
  /// What changed since the last call, one line, empty if nothing: lost, back, at its end,
  /// unreadable.
  virtual std::string news() = 0;
};

}  // namespace mimesis::camera
