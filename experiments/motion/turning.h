#pragma once
#include <array>

#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {

/// No node calls these functions yet: the synthesizer blends its styles' turning patterns by its
/// own rule (repertoire.h) and pivots where a style has none.
///
/// Turning rates of three ways to walk: their recorded turn per cycle over its duration, + to the
/// left [rad/s].
struct TurnRates {
  double left, straight, right;
};

/// @throws ConfigError unless left > straight > right.
TurnRates turn_rates(const mocap::Trial& left, const mocap::Trial& straight,
                     const mocap::Trial& right);

/// Shares of (left, straight, right), of sum one, that turn at that rate: between straight and the
/// side it lies on, linearly [M18 3.5, 3.6: piecewise by the sign of dφ/dt]. Beyond the recorded
/// rates the side alone. Does not allocate.
std::array<double, 3> turn_shares(const TurnRates& rates, double rate_rad_s);

/// An emotional walk made to blend with neutral curved ones [M18 eq. 3.28]:
///   ¾ emotional + ⅛((1 + β) left + (1 − β) right), of weights and all else.
/// @throws ConfigError if β is outside [−1, 1] (the text prints 0 < β < 1; a walk that declines to
/// the left needs β < 0)
MotionParameters balanced_mixture(const MotionParameters& emotional, const MotionParameters& left,
                                  const MotionParameters& right, double beta);

/// β for which the mixture of these turning rates goes straight; at the bounds [−1, 1] where none
/// does.
double balancing_beta(double emotional_rad_s, double left_rad_s, double right_rad_s);

}  // namespace mimesis::synthesizer
