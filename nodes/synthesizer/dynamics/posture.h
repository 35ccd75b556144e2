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

/// Travel of 16 pelvises in a step, by the rows of root_cycle.h at their phases.
struct alignas(64) TravelLanes {
  Lane row[11] = {};             ///< RootRow at the phase after the step
  Lane before[3] = {};           ///< forward, left, turn at the phase before it
  Lane advanced = {};            ///< phase of the step [rad]
  Lane turn_rate = {};           ///< turn of the heading beside the rows' [rad/s]
  Lane fresh;                    ///< 1: the phase has jumped; the pelvis stays
  Lane lowered = {}, rate = {};  ///< of the pelvis, for a leg that is too short [m, m/s]
  // the step
  Lane dx = {}, dy = {};         ///< ΔP in H before the step [m]
  Lane cos_turn, sin_turn = {};  ///< cosine and sine of Δψ
  Lane turn = {};                ///< Δψ [rad]
  Lane height = {};              ///< height of the pelvis above the ground [m]

  TravelLanes();
};

void travel(float dt_s, TravelLanes& pelvis);

/// Phase before and after a contact within which a foot comes to rest, and leaves [rad].
inline constexpr float kRestsFrom = 0.125F;

/// Feet of 16 figures on the ground. What a posture and the travel of its pelvis make of a foot
/// that stands, by the rows, slides and hovers by the error of the model, of blends, and of turns.
/// The foot is displaced by d and turned by a yaw so that it rests: the point on which it stands,
/// heel or toe or between, and its direction stay in the world, its sole is on the ground. Within
/// kRestsFrom before and after a contact the share w of this goes from 0 to 1, so that neither
/// place nor velocity of the foot jumps. In the air d and yaw return, by phase, to those with which
/// the foot lands: the rows' lead, and half of a stance's turn; and the sole is 2.5 cm above the
/// ground. The leg follows by place_foot(). Where it is too short, the pelvis sinks, as a
/// critically damped oscillator of 15 1/s.
struct alignas(64) FeetLanes {
  Lane d[2][2] = {};      ///< displacement in H [m]; [mocap::Side]
  Lane yaw[2] = {};       ///< [rad]
  Lane point[4][3] = {};  ///< left heel, left toe, right heel, right toe as they are, in H [m]
  Lane fresh;             ///< 1: there is no step before

  FeetLanes();
};

/// Changes `angle` (kBodyRows lanes of axis-angle components [rad]) of hips, knees and ankles, and
/// the points below the hips. `rotation`: as posture() left it.
void plant_feet(float dt_s, const RotationLanes& rotation, TravelLanes& travel, Lane* angle,
                PointLanes& point, FeetLanes& feet);

}  // namespace mimesis::synthesizer
