#pragma once
#include <span>
#include <string>
#include <vector>

#include "common/motion/model/motion_model.h"

/// Joint limits of a model's rows. A mixture is an approximation, so it passes limits that its
/// trials kept; demix reports by how much. Blends of patterns with tied delays and shares that are
/// not negative and sum to 1 stay between their patterns, row by row and at every phase: they keep
/// what the patterns keep. Other shares (exaggerated styles, weights that change sign), parameters
/// from maps and cross-fades between models can pass limits.
namespace mimesis::synthesizer {

/// Moves values that are beyond their row's limits to the limit (of floats: the last one within).
/// Rows without limits stay. Values that are not numbers become the lower limit. Does not allocate.
/// @param values  R of them [rad], in the model's order
/// @return number of rows that were moved
int clamp_to_limits(const MotionModel& model, std::span<float> values);
int clamp_to_limits(const MotionModel& model, std::span<double> values);

/// How near to its limits a row comes, over all patterns and the T phases of the sources.
struct LimitExcess {
  std::string row;
  double beyond_rad = 0.0;  ///< largest; negative: what is left to the nearer limit
  std::size_t pattern = 0;  ///< where that is
  double phase_rad = 0.0;
};
/// Of all rows with limits, in the model's order.
std::vector<LimitExcess> limit_excess(const MotionModel& model);

}  // namespace mimesis::synthesizer
