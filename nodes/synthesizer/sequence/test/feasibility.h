#pragma once
#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {

/// Largest violations of a body's limits over all samples.
struct Feasibility {
  /// sliding of a point that stays on the ground, over its whole stand
  double stance_slide_m = 0.0;
  double penetration_m = 0.0;  ///< depth of heels and toes below the ground
  double short_by_m = 0.0;     ///< missing distance of foot and hand to their targets
  double least_knee_rad = 0.0, most_knee_rad = 0.0;
  double most_elbow_rad = 0.0, most_hip_rad = 0.0, most_ankle_rad = 0.0, most_trunk_rad = 0.0;
  double joint_speed_rad_s = 0.0;  ///< norm of a joint's axis-angle velocity
  double pelvis_speed_m_s = 0.0;
  double backwards_m_s = 0.0;  ///< speed of the pelvis against the way; 0 if it never goes back
  double hand_error_m = 0.0;   ///< error left at the handle and right at the object

  /// Within the ranges of a healthy adult. A rocking foot point counts as still below 1 mm.
  bool feasible() const;
};

Feasibility assess(const mocap::Body& body, const RenderedTrial& trial);
/// The worst of both, member by member.
Feasibility worst(const Feasibility& a, const Feasibility& b);

}  // namespace mimesis::synthesizer
