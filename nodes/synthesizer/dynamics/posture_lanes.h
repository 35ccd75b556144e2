#pragma once
#include "nodes/synthesizer/dynamics/posture.h"

namespace mimesis::synthesizer {

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

}  // namespace mimesis::synthesizer
