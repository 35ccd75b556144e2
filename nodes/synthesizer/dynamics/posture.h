#pragma once
#include "common/motion/mocap/body.h"
#include "nodes/synthesizer/dynamics/lanes.h"

namespace mimesis::synthesizer {

/// Segment lengths of a body in float.
struct BodyLanes {
  explicit BodyLanes(const mocap::Body& body);
  Vec3 offset[mocap::kBodyJoints];  ///< joint centre in the parent's frame [m]
  Vec3 foot[4];                     ///< left heel, left toe, right heel, right toe in the ankles'
};

/// Points of 16 figures [m], three lanes each.
struct alignas(64) PointLanes {
  Lane joint[mocap::kBodyJoints][3];
  Lane foot[4][3];  ///< left heel, left toe, right heel, right toe
};

/// Rotations of all joints relative to the frame of the points, columns one after the other.
struct alignas(64) RotationLanes {
  Lane joint[mocap::kBodyJoints][9];
};

/// Forward kinematics of 16 figures with their pelvis at the origin: what mocap::forward_kinematics
/// computes for one. `angle`: kBodyRows lanes of axis-angle components [rad].
void posture(const BodyLanes& body, const Lane* angle, RotationLanes& rotation, PointLanes& point);

/// The body of posture(), for one instruction set: that of the function it is expanded in.
[[gnu::always_inline]] inline void posture_lanes(const BodyLanes& body, const Lane* angle,
                                                 RotationLanes& rotation, PointLanes& point) {
#pragma GCC ivdep
  for (int l = 0; l < kLanes; ++l) {
    store(exp_lane(load(angle, l)), rotation.joint[0], l);
    store(Vec3{0.0F, 0.0F, 0.0F}, point.joint[0], l);
  }
  for (int j = 1; j < mocap::kBodyJoints; ++j) {
    const int parent = mocap::kBodyParents[static_cast<std::size_t>(j)];
    const Vec3 offset = body.offset[j];
#pragma GCC ivdep
    for (int l = 0; l < kLanes; ++l) {
      const Mat3 R_HP = load_rotation(rotation.joint[parent], l);
      store(R_HP * exp_lane(load(angle + 3 * j, l)), rotation.joint[j], l);
      store(load(point.joint[parent], l) + R_HP * offset, point.joint[j], l);
    }
  }
  for (int f = 0; f < 4; ++f) {
    const int ankle = f < 2 ? mocap::kLeftAnkle : mocap::kRightAnkle;
    const Vec3 offset = body.foot[f];
#pragma GCC ivdep
    for (int l = 0; l < kLanes; ++l) {
      store(load(point.joint[ankle], l) + load_rotation(rotation.joint[ankle], l) * offset,
            point.foot[f], l);
    }
  }
}

/// Root motion of 16 figures from their standing feet [M18 3.5]: the pelvis moves and turns so that
/// the standing foot rests on the ground.
///
/// Heading frame H: origin at the pelvis, z up, x along the heading. From one step to the next the
/// point of the standing foot that is lower rests in the world W (near flat contact heel and toe
/// are mixed, over 2 cm of height difference), and so does the direction from heel to toe:
///   Δψ = −Δ∠(toe − heel),   ΔP = q₀ − Rz(Δψ) q₁,   q the resting point in H before and after.
/// Height: the lowest of the four foot points touches the ground.
///
/// Which foot stands: the one with the smaller
///   Jf = (zf − min z)/2 cm + |vf − v̄|/0.5 m/s,
/// zf the height of its lowest point, vf the pelvis velocity it would mean, v̄ the velocity of the
/// last 0.3 s; it changes when the other's J is smaller by 0.3. So the swinging foot is recognised
/// by its speed, forwards, backwards and sideways, and changes happen where both agree about the
/// pelvis. The two feet still differ by up to 1 m/s then. So that the pelvis' velocity has no jump,
/// its place continues from the place by the old foot, p₀ = 0, ṗ₀ = difference, and returns to the
/// place by the new foot, p̈ = −2λṗ − λ²p with λ = 20 1/s: 1.8 cm away at most for a difference of 1
/// m/s, all of it forgotten after 0.3 s, no travel lost. That foot slides by as much (foot_lock()
/// holds it). Turns are treated in the same way.
struct alignas(64) RootLanes {
  // state
  Lane foot[4][3] = {};                         ///< the points of the step before, in its H [m]
  Lane mean_vx = {}, mean_vy = {}, known = {};  ///< v̄·known, known → 1 as it fills
  Lane support = {};                            ///< 0 left, 1 right
  Lane ease[3] = {}, ease_rate[3] = {};  ///< p and ṗ: x, y of H [m, m/s], turn [rad, rad/s]
  Lane fresh;                            ///< 1: there is no step before; the pelvis stays
  /// Displacement of each foot by the foot lock, in H [m]; 0 without. The pelvis follows the
  /// standing foot's displacement with a time constant of 0.12 s, which returns the leg to the
  /// synthesized posture.
  Lane displaced[2][2] = {};
  // the last step
  Lane dx = {}, dy = {};         ///< ΔP in H before the step [m]
  Lane cos_turn, sin_turn = {};  ///< cosine and sine of Δψ
  Lane turn = {};                ///< Δψ [rad]
  Lane height = {};              ///< height of the pelvis above the ground [m]
  Lane slip[2][2] = {};    ///< velocity in W of each foot's lower point, in H after the step [m/s]
  Lane clearance[2] = {};  ///< height of each foot's lower point above the ground [m]

  RootLanes();
};

void root_motion(const PointLanes& point, float dt_s, RootLanes& root);

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
  /// velocity of the lower point in W after the lock, in H [m/s]
  Lane velocity[2][2] = {};
};

/// Advances contact and displacement by a step of root_motion(), and passes them to the root.
void foot_contact(RootLanes& root, float dt_s, LockLanes& lock);

/// Displaces the feet: changes `angle` (kBodyRows lanes of axis-angle components [rad]) of hips,
/// knees and ankles and the points below the hips. A foot with d = 0 keeps its bits. A target out
/// of reach is approached along the line from the hip. `rotation`: as posture() left it.
void foot_lock(const LockLanes& lock, const RotationLanes& rotation, Lane* angle,
               PointLanes& point);

}  // namespace mimesis::synthesizer
