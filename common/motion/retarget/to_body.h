#pragma once
#include "common/motion/retarget/contacts.h"

namespace mimesis::retarget {

/// How far a retargeted motion is from the recorded one, scaled by the length of the legs.
struct BodyReport {
  double scale = 1.0;                         ///< length of the legs, new : recorded
  double hand_rms_m = 0.0, hand_max_m = 0.0;  ///< finger tips against the scaled recorded ones
  /// Change of the joints' rotations relative to their parents: all joints, all frames.
  double rotation_rms_rad = 0.0, rotation_max_rad = 0.0;
  double pelvis_lowered_max_m = 0.0;  ///< so that short legs reach
  // Points of the feet while they stand
  double stance_speed_m_s = 0.0;           ///< mean horizontal speed
  double stance_speed_unlocked_m_s = 0.0;  ///< if the rotations alone had been kept
  double stance_height_max_m = 0.0;        ///< |height| of the lower point of a standing foot
  double lowest_m = 0.0;                   ///< of all foot points; < 0 would be below the ground
};

struct BodyMotion {
  mocap::BodyClip clip;  ///< on the ground z = 0
  Contacts contacts;
  BodyReport report;
};

/// The motion of another figure: rotations are kept, height and travel of the pelvis (the middle
/// between the hips) are scaled by the length of the legs. Feet stand still: a standing foot's
/// first point of contact stays where it met the ground, the next one where it comes down, and no
/// point goes below the ground; the legs follow (leg_ik.h), the pelvis comes down where they would
/// be too short. Between stances the correction fades into the next one.
/// @throws ConfigError if the clip has no frames, is not finite or a body has no legs
BodyMotion retarget(const mocap::BodyClip& recorded, const mocap::Body& to);

}  // namespace mimesis::retarget
