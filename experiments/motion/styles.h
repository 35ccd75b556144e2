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

/// An emotional walk made to blend with neutral curved ones [M18 eq. 3.28]:
///   ¾ emotional + ⅛((1 + β) left + (1 − β) right), of weights and all else.
/// β in [−1, 1] (the text prints 0 < β < 1; a walk that declines to the left needs β < 0).
MotionParameters balanced_mixture(const MotionParameters& emotional, const MotionParameters& left,
                                  const MotionParameters& right, double beta);

/// @throws ConfigError if the model has no pattern or one of another size.
Styles styles_of(const motion::MotionModel& model, double min_similarity = 0.95);

}  // namespace mimesis::synthesizer
