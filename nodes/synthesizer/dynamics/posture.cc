#include "nodes/synthesizer/dynamics/posture.h"

#include <algorithm>
#include <cmath>

#include "common/math/vector_clones.h"

namespace mimesis::synthesizer {

namespace {

Vec3 to_lane(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

inline float smaller(float a, float b) { return a < b ? a : b; }
inline float larger(float a, float b) { return a > b ? a : b; }

constexpr float kApproach = 0.25F;                     // rad
constexpr float kReturn = 2.5F;                        // 1/rad
constexpr float kFarthest = 0.15F;                     // m
constexpr float kSink = 17.0F;                         // 1/s
constexpr float kReserve = 0.004F;                     // m, of a leg
constexpr float kHalfStance = 1.9F;                    // rad
constexpr float kClear = 0.025F, kClearRound = 0.02F;  // m, of a foot in the air
constexpr float kSteps = 400.0F;  // 1/share of a walk that lifts its feet whole
// 1/share, rad: walks with a smaller share, steps that are short, have longer contacts
constexpr float kSmall = 5.0F, kLonger = 0.52F;

inline float clamped(float x) { return smaller(larger(x, 0.0F), 1.0F); }
inline float eased(float x) { return x * x * (3.0F - 2.0F * x); }

/// Sine and cosine of |x| ≤ 1, to 3e-6.
inline float sine_of(float x) {
  const float u = x * x;
  return x * (1.0F - u * (1.0F / 6.0F) * (1.0F - u * (1.0F / 20.0F) * (1.0F - u * (1.0F / 42.0F))));
}
inline float cosine_of(float x) {
  const float u = x * x;
  return 1.0F -
         u * 0.5F * (1.0F - u * (1.0F / 12.0F) * (1.0F - u * (1.0F / 30.0F) * (1.0F - u / 56.0F)));
}
/// Arc sine of small numbers.
inline float arc_of(float s) { return s * (1.0F + s * s * (1.0F / 6.0F + s * s * (3.0F / 40.0F))); }

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

TravelLanes::TravelLanes() {
  std::fill_n(fresh, kLanes, 1.0F);
  std::fill_n(cos_turn, kLanes, 1.0F);
}

FeetLanes::FeetLanes() { std::fill_n(fresh, kLanes, 1.0F); }

MIMESIS_VECTOR_CLONES
void travel(float dt_s, TravelLanes& t) {
#pragma GCC ivdep
  for (int l = 0; l < kLanes; ++l) {
    const float part = t.fresh[l] > 0.5F ? 0.0F : 0.5F * t.advanced[l];
    const float x = part * (t.before[0][l] + t.row[0][l]);
    const float y = part * (t.before[1][l] + t.row[1][l]);
    const float turn = part * (t.before[2][l] + t.row[2][l]) + dt_s * t.turn_rate[l];
    t.dx[l] = x - 0.5F * turn * y;  // along the heading of the middle
    t.dy[l] = y + 0.5F * turn * x;
    t.cos_turn[l] = cosine_of(turn);
    t.sin_turn[l] = sine_of(turn);
    t.turn[l] = turn;
    t.height[l] = t.row[3][l] - t.lowered[l];
    for (int k = 0; k < 3; ++k) t.before[k][l] = t.row[k][l];
    t.fresh[l] = 0.0F;
  }
}

MIMESIS_VECTOR_CLONES
void plant_feet(float dt_s, const RotationLanes& rotation, TravelLanes& t, Lane* angle,
                PointLanes& point, FeetLanes& feet) {
  alignas(64) Lane missing;
  for (float& m : missing) m = -1.0F;
  for (int f = 0; f < 2; ++f) {
    const int hip = f == 0 ? mocap::kLeftHip : mocap::kRightHip, knee = hip + 1, ankle = hip + 2;
#pragma GCC ivdep
    for (int l = 0; l < kLanes; ++l) {
      const float c = t.cos_turn[l], s = t.sin_turn[l], px = t.dx[l], py = t.dy[l];
      const Vec3 heel0 = load(feet.point[2 * f], l), toe0 = load(feet.point[2 * f + 1], l);
      // the foot before, in H after the step
      const Vec3 heel_b{c * (heel0.x - px) + s * (heel0.y - py),
                        c * (heel0.y - py) - s * (heel0.x - px), heel0.z};
      const Vec3 toe_b{c * (toe0.x - px) + s * (toe0.y - py), c * (toe0.y - py) - s * (toe0.x - px),
                       toe0.z};
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
      const Vec3 heel_p = load(point.foot[2 * f], l), toe_p = load(point.foot[2 * f + 1], l);
      const Vec3 heel_a = heel_p - leg.ankle, toe_a = toe_p - leg.ankle;

      const bool fresh = feet.fresh[l] > 0.5F;
      const float small = 1.0F - clamped(kSmall * t.row[6][l]);
      const float margin = t.row[4 + f][l] / larger(t.row[6][l], 1e-3F) + kLonger * small * small;
      const float held = eased(clamped(1.0F + margin * (1.0F / kApproach)));
      const float dx0 = feet.d[f][0][l], dy0 = feet.d[f][1][l];
      const float far = std::sqrt(dx0 * dx0 + dy0 * dy0) * (1.0F / kFarthest);
      const float rests = eased(clamped(1.0F + margin * (1.0F / kRestsFrom)));
      const float w = fresh ? 0.0F : rests * (1.0F - eased(clamped(5.0F * (far - 0.8F))));
      const float back = kReturn * t.advanced[l] * eased(clamped(-2.0F * margin));
      const float lands = fresh ? 0.0F : (1.0F - w) * back, rest = fresh ? 0.0F : 1.0F - lands;
      // a turn beside the pattern's: half of that of a stance ahead
      const float lead = t.turn_rate[l] * dt_s * kHalfStance / larger(t.advanced[l], 0.5F * dt_s);

      // direction of the foot
      const float yaw0 = feet.yaw[f][l], c0 = cosine_of(yaw0), s0 = sine_of(yaw0);
      const Vec3 way = toe_a - heel_a, way_b = toe_b - heel_b;
      const float wx = c0 * way.x - s0 * way.y, wy = s0 * way.x + c0 * way.y;
      const float n = std::sqrt((wx * wx + wy * wy) * (way_b.x * way_b.x + way_b.y * way_b.y));
      const bool level = n > 1e-4F;
      const float off = level ? arc_of((way_b.x * wy - way_b.y * wx) / n) : 0.0F;
      const float yaw = smaller(larger(rest * yaw0 + lands * lead - w * off, -0.9F), 0.9F);
      const float cy = cosine_of(yaw), sy = sine_of(yaw);
      const Vec3 heel{cy * heel_a.x - sy * heel_a.y, sy * heel_a.x + cy * heel_a.y, heel_a.z};
      const Vec3 toe{cy * toe_a.x - sy * toe_a.y, sy * toe_a.x + cy * toe_a.y, toe_a.z};

      // its place: that of the point on which it stands
      const float share = heel_share_lane(heel_a.z, toe_a.z);
      const float kx = c * dx0 + s * dy0, ky = c * dy0 - s * dx0;
      const float off_x = leg.ankle.x + kx + toe.x + share * (heel.x - toe.x) - toe_b.x -
                          share * (heel_b.x - toe_b.x);
      const float off_y = leg.ankle.y + ky + toe.y + share * (heel.y - toe.y) - toe_b.y -
                          share * (heel_b.y - toe_b.y);
      const float lead_x = t.row[7 + 2 * f][l] - lead * leg.ankle.y;
      const float lead_y = t.row[8 + 2 * f][l] + lead * leg.ankle.x;
      const float dx = rest * kx + lands * lead_x - w * off_x;
      const float dy = rest * ky + lands * lead_y - w * off_y;
      const float z = t.height[l] + sole_lane(heel_p.z, toe_p.z);
      const float steps = clamped(kSteps * t.row[6][l]);
      const float clear = z - kClear * eased(clamped(-3.5F * margin - 0.35F)) * steps;
      const float round = kClearRound * steps + 1e-4F;
      const float near = larger(round - larger(clear, -clear), 0.0F);
      const float raised = larger(-clear, 0.0F) + near * near * (0.25F / round);
      const float dz = raised - held * (z + raised);

      const Vec3 old = leg.ankle, target = old + Vec3{dx, dy, dz}, to = target - leg.hip;
      const Vec3 k = leg.knee - leg.hip, a = leg.ankle - leg.knee;
      const float length = std::sqrt(dot(k, k)) + std::sqrt(dot(a, a)) - kReserve;
      const float wanted = std::sqrt(dot(to, to));
      const float short_by =
          (wanted - length) * wanted / larger(-to.z, 0.3F) - 0.1F * (1.0F - held);
      missing[l] = larger(missing[l], short_by);
      place_foot(target, cy, sy, leg);

      const Vec3 moved = leg.ankle - old;
      feet.d[f][0][l] = moved.x;
      feet.d[f][1][l] = moved.y;
      feet.yaw[f][l] = yaw;
      store(leg.ankle + heel, feet.point[2 * f], l);
      store(leg.ankle + toe, feet.point[2 * f + 1], l);
      store(leg.ankle + heel, point.foot[2 * f], l);
      store(leg.ankle + toe, point.foot[2 * f + 1], l);
      store(leg.hip_angle, angle + 3 * hip, l);
      store(leg.knee_angle, angle + 3 * knee, l);
      store(leg.ankle_angle, angle + 3 * ankle, l);
      store(leg.knee, point.joint[knee], l);
      store(leg.ankle, point.joint[ankle], l);
    }
  }
#pragma GCC ivdep
  for (int l = 0; l < kLanes; ++l) {  // semi-implicit: stable for kSink·dt < 1
    const float need = larger(t.lowered[l] + missing[l], 0.0F);
    const float a = kSink * (kSink * (need - t.lowered[l]) - 2.0F * t.rate[l]);
    t.rate[l] += dt_s * a;
    t.lowered[l] += dt_s * t.rate[l];
    feet.fresh[l] = 0.0F;
  }
}

}  // namespace mimesis::synthesizer
