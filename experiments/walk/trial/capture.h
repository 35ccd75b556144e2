#pragma once
#include "hw/sim/body/walk_judge.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walk {

/// A capturability bound [Koolen et al., IJRR 2012] of the linear inverted pendulum with finite
/// feet: whether a state can be brought to rest with the feet that stand, or with the landing of
/// the foot that swings, no later and no sooner than planned.
///
/// Feet that stand capture what is within the hull of their soles, here its bounding rectangle in
/// the heading. One foot that stands holds the ZMP at the point z of its sole nearest to ξ, so that
///
///     ξ(T) = z + (ξ − z) e^(ωT)                                     [docs/walking.md eq. 1.3]
///
/// at the landing, which captures it if a sole can be put below it: within the longest, narrowest
/// and widest step. No state outside is captured without a second step or arms; of those inside
/// delays, senses and what the feet weigh take some.
struct Capturability {
  bool capturable = false;
  double beyond_m = 0.0;  ///< distance of ξ from where it would be; 0: capturable
};

/// `xi_m`: divergent component in the plan's world [m]; `omega_1_s`: √(g/h).
Capturability capturability(const robot::Biped& biped, const walker::GaitSettings& gait,
                            const walker::PatternSample& plan, const Eigen::Vector2d& xi_m,
                            double omega_1_s);

}  // namespace mimesis::walk
