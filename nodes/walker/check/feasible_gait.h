#pragma once
#include <string>

#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// What a walk asks of the joints of the legs, without what balancing adds.
struct GaitLoad {
  double speed_share = 0.0, torque_share = 0.0;  ///< largest share of a joint's limit [1]
  std::string speed_joint, torque_joint;         ///< the joint that it is
  double speed_rad_s = 0.0, torque_n_m = 0.0;    ///< of that joint
  int short_ticks = 0;                           ///< a leg was too short, or at a limit of a joint
};

/// Walks the plan of the MPC with the whole body, at constant velocity, upper body at rest, from
/// standing until the sixth landing; the joints' rates and, by inverse dynamics with the ground's
/// force shared between the feet as planned, their torques. @param filtered  with the dynamic
/// filter
GaitLoad load_of_gait(const robot::Biped& biped, const GaitSettings& gait, const Wish& wish,
                      bool filtered);

/// The fastest gait whose joints keep to a share of their limits.
struct FeasibleGait {
  bool possible = false;  ///< it can step in place at least
  GaitSettings gait;
  GaitLoad load;        ///< of the fastest walk forward, or of steps in place if not possible
  bool slowed = false;  ///< below what the length of the legs gives
  GaitLoad beyond;      ///< if slowed: of the full speed that the legs' length gives
};

/// Tries longer steps, lower ones and slower ones than gait_settings(), in this order of
/// preference: speed, height, step time.
/// @param share  of speed and torque limits that a plan may use; the rest is left to balance
FeasibleGait feasible_gait(const robot::Biped& biped, double share = 0.9);

}  // namespace mimesis::walker
