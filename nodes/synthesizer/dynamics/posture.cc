#include "nodes/synthesizer/dynamics/posture.h"

#include <algorithm>
#include <cmath>

#include "common/math/vector_clones.h"

namespace mimesis::synthesizer {

namespace {

Vec3 to_lane(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

constexpr float kFlat = 0.02F;         // m: heel and toe this near in height both carry
constexpr float kHeightScale = 0.02F;  // m
constexpr float kSpeedScale = 0.5F;    // m/s
constexpr float kMemory = 0.3F;        // s
constexpr float kHysteresis = 0.3F;
constexpr float kFollow = 0.12F;  // s
constexpr float kEase = 20.0F;    // 1/s

inline float smaller(float a, float b) { return a < b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }

/// Motion of the pelvis if one foot were at rest.
struct FootMotion {
  float z;       ///< height of its lower point below the pelvis (negative) [m]
  Vec3 q0, q1;   ///< its resting point before and after
  float dx, dy;  ///< ΔP in H before the step [m]
  float c, s;    ///< cosine and sine of Δψ
  float heel;    ///< share of the heel in the resting point
};

inline FootMotion foot_motion(Vec3 heel0, Vec3 toe0, Vec3 heel1, Vec3 toe1) {
  FootMotion m;
  m.z = smaller(heel1.z, toe1.z);
  const float u = smaller(larger(0.5F + (toe1.z - heel1.z) * (0.5F / kFlat), 0.0F), 1.0F);
  m.heel = u * u * (3.0F - 2.0F * u);
  m.q0 = toe0 + m.heel * (heel0 - toe0);
  m.q1 = toe1 + m.heel * (heel1 - toe1);
  const Vec3 a = toe0 - heel0, b = toe1 - heel1;
  const float n = std::sqrt((a.x * a.x + a.y * a.y) * (b.x * b.x + b.y * b.y));
  const bool level = n > 1e-6F;  // a foot that points straight down has no direction
  const float c = (a.x * b.x + a.y * b.y) / n, s = (a.y * b.x - a.x * b.y) / n;
  m.c = level ? c : 1.0F;
  m.s = level ? s : 0.0F;
  m.dx = m.q0.x - (m.c * m.q1.x - m.s * m.q1.y);
  m.dy = m.q0.y - (m.s * m.q1.x + m.c * m.q1.y);
  return m;
}

/// Lets a deviation e with rate v return to zero, ë = −2λė − λ²e, exactly over dt. `fade`: e^{−λdt}
inline void settle(float& e, float& v, float lambda, float dt_s, float fade) {
  const float a = v + lambda * e, next = (e + a * dt_s) * fade;
  v = a * fade - lambda * next;
  e = next;
}

constexpr float kLow = 0.02F, kHigh = 0.03F;     // m
constexpr float kSlow = 0.4F, kFast = 0.6F;      // m/s
constexpr float kFarthest = 0.1F;                // m
constexpr float kStop = 0.02F, kReturn = 25.0F;  // s, 1/s

inline Vec3 choose(bool condition, Vec3 a, Vec3 b) {
  return {condition ? a.x : b.x, condition ? a.y : b.y, condition ? a.z : b.z};
}

}  // namespace

BodyLanes::BodyLanes(const mocap::Body& body) {
  for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) offset[j] = to_lane(body.offset_m[j]);
  for (std::size_t side = 0; side < 2; ++side) {
    foot[2 * side] = to_lane(body.heel_m[side]);
    foot[2 * side + 1] = to_lane(body.toe_m[side]);
  }
}

MIMESIS_VECTOR_CLONES
void posture(const BodyLanes& body, const Lane* angle, RotationLanes& rotation, PointLanes& point) {
  posture_lanes(body, angle, rotation, point);
}

RootLanes::RootLanes() {
  std::fill_n(fresh, kLanes, 1.0F);
  std::fill_n(cos_turn, kLanes, 1.0F);
}

MIMESIS_VECTOR_CLONES
void root_motion(const PointLanes& point, float dt_s, RootLanes& r) {
  const float rate = 1.0F / dt_s, share = dt_s < kMemory ? dt_s / kMemory : 1.0F;
  const float follow = 1.0F - std::exp(-dt_s / kFollow);
  const float ease_fade = std::exp(-kEase * dt_s);
#pragma GCC ivdep
  for (int l = 0; l < kLanes; ++l) {
    const Vec3 heel0_l = load(r.foot[0], l), toe0_l = load(r.foot[1], l);
    const Vec3 heel0_r = load(r.foot[2], l), toe0_r = load(r.foot[3], l);
    const Vec3 heel1_l = load(point.foot[0], l), toe1_l = load(point.foot[1], l);
    const Vec3 heel1_r = load(point.foot[2], l), toe1_r = load(point.foot[3], l);
    const FootMotion left = foot_motion(heel0_l, toe0_l, heel1_l, toe1_l);
    const FootMotion right = foot_motion(heel0_r, toe0_r, heel1_r, toe1_r);
    const float lowest = smaller(left.z, right.z);
    const bool fresh = r.fresh[l] > 0.5F;

    // standing foot
    const float known = larger(r.known[l], 1e-6F);
    const float mean_x = r.mean_vx[l] / known, mean_y = r.mean_vy[l] / known;
    const float lx = left.dx * rate - mean_x, ly = left.dy * rate - mean_y;
    const float rx = right.dx * rate - mean_x, ry = right.dy * rate - mean_y;
    const float trust = fresh ? 0.0F : r.known[l] * (1.0F / kSpeedScale);
    const float cost_left =
        (left.z - lowest) * (1.0F / kHeightScale) + trust * std::sqrt(lx * lx + ly * ly);
    const float cost_right =
        (right.z - lowest) * (1.0F / kHeightScale) + trust * std::sqrt(rx * rx + ry * ry);
    const float keep = fresh ? 0.0F : kHysteresis;
    const bool was_right = r.support[l] > 0.5F;
    const float ahead = cost_left - cost_right;  // lead of the right foot
    const bool is_right = ahead > (was_right ? -keep : keep);
    r.support[l] = is_right ? 1.0F : 0.0F;

    // the pelvis by each foot; their difference at a change of support is eased
    const float changed = fresh ? 0.0F : (is_right ? 1.0F : 0.0F) - (was_right ? 1.0F : 0.0F);
    auto ease = [&](float difference, int axis) {
      float e = r.ease[axis][l], v = r.ease_rate[axis][l] + changed * difference * rate;
      settle(e, v, kEase, dt_s, ease_fade);
      const float moved = e - r.ease[axis][l];
      r.ease[axis][l] = e;
      r.ease_rate[axis][l] = v;
      return moved;
    };
    const float own_c = is_right ? right.c : left.c, own_s = is_right ? right.s : left.s;
    const float more = ease(left.s - right.s, 2);
    const float mc = 1.0F - 0.5F * more * more, ms = more * (1.0F - more * more * (1.0F / 6.0F));
    const float c = fresh ? 1.0F : own_c * mc - own_s * ms;
    const float s = fresh ? 0.0F : own_s * mc + own_c * ms;
    auto x_of = [c, s](const FootMotion& m) { return m.q0.x - (c * m.q1.x - s * m.q1.y); };
    auto y_of = [c, s](const FootMotion& m) { return m.q0.y - (s * m.q1.x + c * m.q1.y); };
    const float left_x = x_of(left) + follow * r.displaced[0][0][l];
    const float left_y = y_of(left) + follow * r.displaced[0][1][l];
    const float right_x = x_of(right) + follow * r.displaced[1][0][l];
    const float right_y = y_of(right) + follow * r.displaced[1][1][l];
    const float ex = ease(left_x - right_x, 0), ey = ease(left_y - right_y, 1);
    const float dx = fresh ? 0.0F : (is_right ? right_x : left_x) + ex;
    const float dy = fresh ? 0.0F : (is_right ? right_y : left_y) + ey;
    r.cos_turn[l] = c;
    r.sin_turn[l] = s;
    r.turn[l] = s * (1.0F + s * s * (1.0F / 6.0F + s * s * (3.0F / 40.0F)));  // arcsine
    r.dx[l] = dx;
    r.dy[l] = dy;
    r.height[l] = -lowest;
    const float fill = fresh ? 0.0F : share;
    r.mean_vx[l] += fill * (dx * rate - r.mean_vx[l]);
    r.mean_vy[l] += fill * (dy * rate - r.mean_vy[l]);
    r.known[l] += fill * (1.0F - r.known[l]);

    // resulting motion of the feet: velocity of a point = Rz(−Δψ)(ΔP − q₀) + q₁ over dt
    auto foot = [&](const FootMotion& m, int f) {
      const float x = dx - m.q0.x, y = dy - m.q0.y;
      r.slip[f][0][l] = fresh ? 0.0F : (c * x + s * y + m.q1.x) * rate;
      r.slip[f][1][l] = fresh ? 0.0F : (c * y - s * x + m.q1.y) * rate;
      r.clearance[f][l] = m.z - lowest;
    };
    foot(left, 0);
    foot(right, 1);
    store(heel1_l, r.foot[0], l);
    store(toe1_l, r.foot[1], l);
    store(heel1_r, r.foot[2], l);
    store(toe1_r, r.foot[3], l);
    r.fresh[l] = 0.0F;
  }
}

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
      // one after the other, as numbers: the compiler makes vectors of them
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
