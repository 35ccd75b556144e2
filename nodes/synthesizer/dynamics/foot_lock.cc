#include "nodes/synthesizer/dynamics/foot_lock.h"

#include <cmath>

#include "common/math/vector_clones.h"
#include "nodes/synthesizer/dynamics/leg_lanes.h"

namespace mimesis::synthesizer {
namespace {

constexpr float kLow = 0.02F, kHigh = 0.03F;     // m
constexpr float kSlow = 0.4F, kFast = 0.6F;      // m/s
constexpr float kFarthest = 0.1F;                // m
constexpr float kStop = 0.02F, kReturn = 25.0F;  // s, 1/s

inline Vec3 choose(bool condition, Vec3 a, Vec3 b) {
  return {condition ? a.x : b.x, condition ? a.y : b.y, condition ? a.z : b.z};
}

}  // namespace

MIMESIS_VECTOR_CLONES
void foot_contact(RootLanes& root, float dt_s, LockLanes& lock) {
  const float stop = std::exp(-dt_s / kStop), fade = std::exp(-kReturn * dt_s);
  for (int f = 0; f < 2; ++f) {
#pragma GCC ivdep
    for (int l = 0; l < kLanes; ++l) {
      const float c = root.cos_turn[l], s = root.sin_turn[l];
      auto into_new_heading = [c, s](float& x, float& y) {
        const float x0 = x;
        x = c * x0 + s * y;
        y = c * y - s * x0;
      };
      float dx = lock.d[f][0][l], dy = lock.d[f][1][l];
      float vx = lock.velocity[f][0][l], vy = lock.velocity[f][1][l];
      float rx = lock.rate[f][0][l], ry = lock.rate[f][1][l];
      into_new_heading(dx, dy);
      into_new_heading(vx, vy);
      into_new_heading(rx, ry);
      const float gx = root.slip[f][0][l], gy = root.slip[f][1][l];
      const float speed2 = gx * gx + gy * gy, high = root.clearance[f][l];
      const bool stood = lock.contact[f][l] > 0.5F;
      const float height_limit = stood ? kHigh : kLow, speed_limit = stood ? kFast : kSlow;
      // one after the other, as numbers: what the compiler makes vectors of
      const float low = high < height_limit ? 1.0F : 0.0F;
      const float slow = speed2 < speed_limit * speed_limit ? low : 0.0F;
      const bool stands = (dx * dx + dy * dy < kFarthest * kFarthest ? slow : 0.0F) > 0.5F;
      // standing: the point's own velocity decays. Swinging: d̈ = −2λḋ − λ²d, exactly over dt
      rx = stood ? vx - gx : rx;  // the foot leaves with the velocity it has
      ry = stood ? vy - gy : ry;
      const float ax = rx + kReturn * dx, ay = ry + kReturn * dy;
      const float bx = (dx + ax * dt_s) * fade, by = (dy + ay * dt_s) * fade;
      const float new_rx = ax * fade - kReturn * bx, new_ry = ay * fade - kReturn * by;
      // back at rest: exact zeros, so that nothing small is dragged along
      const float left = bx * bx + by * by + 1e-4F * (new_rx * new_rx + new_ry * new_ry);
      const float keep = left < 1e-12F ? 0.0F : 1.0F;
      const float hold_x = vx * stop, hold_y = vy * stop;
      rx = stands ? hold_x - gx : keep * new_rx;
      ry = stands ? hold_y - gy : keep * new_ry;
      lock.rate[f][0][l] = rx;
      lock.rate[f][1][l] = ry;
      dx = stands ? dx + rx * dt_s : keep * bx;
      dy = stands ? dy + ry * dt_s : keep * by;
      lock.d[f][0][l] = dx;
      lock.d[f][1][l] = dy;
      root.displaced[f][0][l] = dx;
      root.displaced[f][1][l] = dy;
      lock.velocity[f][0][l] = gx + rx;
      lock.velocity[f][1][l] = gy + ry;
      lock.contact[f][l] = stands ? 1.0F : 0.0F;
    }
  }
}

MIMESIS_VECTOR_CLONES
void foot_lock(const LockLanes& lock, const RotationLanes& rotation, Lane* angle,
               PointLanes& point) {
  for (int f = 0; f < 2; ++f) {
    const int hip = f == 0 ? mocap::kLeftHip : mocap::kRightHip, knee = hip + 1, ankle = hip + 2;
#pragma GCC ivdep
    for (int l = 0; l < kLanes; ++l) {
      const float dx = lock.d[f][0][l], dy = lock.d[f][1][l];
      LegLane leg{load(point.joint[hip], l),
                  load(point.joint[knee], l),
                  load(point.joint[ankle], l),
                  load_rotation(rotation.joint[mocap::kRoot], l),
                  load_rotation(rotation.joint[hip], l),
                  load_rotation(rotation.joint[knee], l),
                  load_rotation(rotation.joint[ankle], l),
                  load(angle + 3 * hip, l),
                  load(angle + 3 * knee, l),
                  load(angle + 3 * ankle, l)};
      const Vec3 old_knee = leg.knee, old_ankle = leg.ankle, old_hip_angle = leg.hip_angle,
                 old_knee_angle = leg.knee_angle, old_ankle_angle = leg.ankle_angle;
      move_ankle(dx, dy, leg);
      const bool moves = dx * dx + dy * dy > 0.0F;
      store(choose(moves, leg.hip_angle, old_hip_angle), angle + 3 * hip, l);
      store(choose(moves, leg.knee_angle, old_knee_angle), angle + 3 * knee, l);
      store(choose(moves, leg.ankle_angle, old_ankle_angle), angle + 3 * ankle, l);
      store(choose(moves, leg.knee, old_knee), point.joint[knee], l);
      store(choose(moves, leg.ankle, old_ankle), point.joint[ankle], l);
      const Vec3 by = choose(moves, leg.ankle - old_ankle, Vec3{0.0F, 0.0F, 0.0F});
      store(load(point.foot[2 * f], l) + by, point.foot[2 * f], l);
      store(load(point.foot[2 * f + 1], l) + by, point.foot[2 * f + 1], l);
    }
  }
}

}  // namespace mimesis::synthesizer
