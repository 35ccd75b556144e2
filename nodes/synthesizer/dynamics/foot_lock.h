#pragma once
#include "nodes/synthesizer/dynamics/root_motion.h"

namespace mimesis::synthesizer {

/// Keeps the standing feet of 16 figures in place. The synthesized posture lets a foot slide that
/// should stand, by the error of the model and because root motion serves one foot only. A foot
/// with contact is displaced horizontally by d so that its lower point rests, and the leg follows
/// by two-bone inverse kinematics: hip, knee and ankle turn, pelvis and orientation of the foot
/// stay.
///
/// Contact begins when the foot's lower point is less than 2 cm above the ground and slower than
/// 0.5 m/s; then its speed decays with a time constant of 20 ms. Contact ends above 4 cm, above
/// 1 m/s (as synthesized) or with |d| > 10 cm; then d returns to zero as a critically damped
/// oscillator of 25 1/s, starting with the foot's velocity. So the foot's path has no jump, and its
/// velocity none at release.
struct alignas(64) LockLanes {
  Lane contact[2] = {};                ///< 1: the foot stands; [mocap::Side]
  Lane d[2][2] = {}, rate[2][2] = {};  ///< displacement [m] and its rate [m/s], in H
  Lane velocity[2][2] = {};            ///< of the lower point in W after the lock, in H [m/s]
};

/// Advances contact and displacement by a step of root_motion(), and tells the root.
void foot_contact(RootLanes& root, float dt_s, LockLanes& lock);

/// Displaces the feet: changes `angle` (kBodyRows lanes of axis-angle components [rad]) of hips,
/// knees and ankles and the points below the hips. A foot with d = 0 keeps its bits. A target out
/// of reach is approached along the line from the hip. `rotation`: as posture() left it.
void foot_lock(const LockLanes& lock, const RotationLanes& rotation, Lane* angle,
               PointLanes& point);

}  // namespace mimesis::synthesizer
