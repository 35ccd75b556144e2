#pragma once
#include <string>
#include <vector>

#include "nodes/synthesizer/character/delay_ambiguity.h"
#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {

/// The patterns of a model, one per style (the mean of all patterns of that name), ready to be
/// blended in any proportion.
struct Styles {
  std::vector<std::string> names;  ///< in order of first appearance
  std::vector<MotionParameters> parameters;
  Disambiguation disambiguation;  ///< nothing where the model's delays are tied

  /// @throws ConfigError that lists the styles if there is none of that name.
  std::size_t index(const std::string& name) const;
};

/// @throws ConfigError if the model has no pattern or one of another size.
Styles styles_of(const motion::MotionModel& model, double min_similarity = 0.95);

}  // namespace mimesis::synthesizer
