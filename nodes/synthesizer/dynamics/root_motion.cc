#include "nodes/synthesizer/dynamics/root_motion.h"

#include <algorithm>

#include "common/math/vector_clones.h"

namespace mimesis::synthesizer {
namespace {

constexpr float kFlat = 0.02F;         // m: heel and toe this near in height both carry
constexpr float kHeightScale = 0.02F;  // m
constexpr float kSpeedScale = 0.5F;    // m/s
constexpr float kMemory = 0.3F;        // s
constexpr float kHysteresis = 0.3F;
constexpr float kFollow = 0.12F;  // s
constexpr float kEase = 20.0F;    // 1/s

inline float smaller(float a, float b) { return a < b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }

/// What one foot at rest would mean for the pelvis.
struct FootMotion {
  float z;       ///< height of its lower point below the pelvis (negative) [m]
  Vec3 q0, q1;   ///< its resting point before and after
  float dx, dy;  ///< ΔP in H before the step [m]
  float c, s;    ///< of Δψ
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

}  // namespace

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

    // who stands
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
    const float ahead = cost_left - cost_right;  // of the right foot
    const bool is_right = ahead > (was_right ? -keep : keep);
    r.support[l] = is_right ? 1.0F : 0.0F;

    // where that takes the pelvis; what the feet differ by when the support changes is eased
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

    // what the feet do then: velocity of a point = Rz(−Δψ)(ΔP − q₀) + q₁ over dt
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

}  // namespace mimesis::synthesizer
