#pragma once
#include <cmath>

namespace mimesis::synthesizer {

/// Characters are computed 16 at a time, one in each lane of the vector registers. The functions
/// below work on one lane; loops over the lanes around them are vectorised by the compiler. They
/// have no branch and call nothing but sqrt, and every operation is rounded as IEEE says: a lane's
/// result does not depend on its neighbours or the instruction set.
inline constexpr int kLanes = 16;
using Lane = float[kLanes];

struct Vec3 {
  float x, y, z;
};
inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(float s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
inline float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A rotation by its columns.
struct Mat3 {
  Vec3 x, y, z;
};
inline Vec3 operator*(const Mat3& m, Vec3 v) { return v.x * m.x + (v.y * m.y + v.z * m.z); }
inline Mat3 operator*(const Mat3& a, const Mat3& b) { return {a * b.x, a * b.y, a * b.z}; }
inline Vec3 transposed_times(const Mat3& m, Vec3 v) {
  return {dot(m.x, v), dot(m.y, v), dot(m.z, v)};
}
inline Mat3 transposed_times(const Mat3& a, const Mat3& b) {
  return {transposed_times(a, b.x), transposed_times(a, b.y), transposed_times(a, b.z)};
}

inline Vec3 load(const Lane* a, int l) { return {a[0][l], a[1][l], a[2][l]}; }
inline void store(Vec3 v, Lane* a, int l) {
  a[0][l] = v.x;
  a[1][l] = v.y;
  a[2][l] = v.z;
}
inline Mat3 load_rotation(const Lane* a, int l) {
  return {load(a, l), load(a + 3, l), load(a + 6, l)};
}
inline void store(const Mat3& m, Lane* a, int l) {
  store(m.x, a, l);
  store(m.y, a + 3, l);
  store(m.z, a + 6, l);
}

/// Nearest integer of |x| < 2²², without rounding instructions.
inline float round_lane(float x) {
  constexpr float kMagic = 12582912.0F;  // 1.5·2²³
  return (x + kMagic) - kMagic;
}

/// Exponential map: rotation by the axis-angle vector θw of any length [M18 eq. 3.2]. Turns are
/// taken off, then sin θ/θ and (1 − cos θ)/θ² are power series in θ² ≤ π²: the nine and eight terms
/// cut off less than 1e-8. Entries deviate by less than 2e-6 for |θ| ≤ 2π.
inline Mat3 exp_lane(Vec3 w) {
  constexpr float kTurn = 6.283185307179586F;
  const float theta = std::sqrt(dot(w, w));
  const float turns = round_lane(theta * (1.0F / kTurn));
  const float turned = 1.0F - turns * kTurn / theta;
  const float scale = turns > 0.0F ? turned : 1.0F;
  const Vec3 v = scale * w;
  const float u = dot(v, v);
  float a = 1.0F / 355687428096000.0F;  // 1/17!
  a = a * u - 1.0F / 1307674368000.0F;
  a = a * u + 1.0F / 6227020800.0F;
  a = a * u - 1.0F / 39916800.0F;
  a = a * u + 1.0F / 362880.0F;
  a = a * u - 1.0F / 5040.0F;
  a = a * u + 1.0F / 120.0F;
  a = a * u - 1.0F / 6.0F;
  a = a * u + 1.0F;
  float b = -1.0F / 20922789888000.0F;  // 1/16!
  b = b * u + 1.0F / 87178291200.0F;
  b = b * u - 1.0F / 479001600.0F;
  b = b * u + 1.0F / 3628800.0F;
  b = b * u - 1.0F / 40320.0F;
  b = b * u + 1.0F / 720.0F;
  b = b * u - 1.0F / 24.0F;
  b = b * u + 0.5F;
  const float d = 1.0F - b * u;
  const Vec3 p = a * v;
  const float xy = b * v.x * v.y, xz = b * v.x * v.z, yz = b * v.y * v.z;
  return {{d + b * v.x * v.x, xy + p.z, xz - p.y},
          {xy - p.z, d + b * v.y * v.y, yz + p.x},
          {xz + p.y, yz - p.x, d + b * v.z * v.z}};
}

/// atan2(y, x) for y ≥ 0, not both zero, to 3e-7 rad: arc tangent by Cephes' polynomial of
/// degree 9 on [−tan π/8, tan π/8].
[[gnu::always_inline]] inline float atan2_lane(float y, float x) {
  const float ax = x < 0.0F ? -x : x;
  const bool steep = y > ax;
  const float t = (steep ? ax : y) / (steep ? y : ax), less = (t - 1.0F) / (t + 1.0F);
  const bool upper = t > 0.41421356F;
  const float v = upper ? less : t, u = v * v;
  float p = 8.05374449538e-2F;
  p = p * u - 1.38776856032e-1F;
  p = p * u + 1.99777106478e-1F;
  p = p * u - 3.33329491539e-1F;
  const float flat = (upper ? 0.78539816F : 0.0F) + (v + v * u * p);
  const float front = steep ? 1.57079633F - flat : flat;
  return x < 0.0F ? 3.14159265F - front : front;
}

/// Axis-angle vector of a rotation, the one nearest to `reference` (turns by 2π are added).
/// Within 3e-6 rad for angles up to 3 rad; the last degrees below π lose digits.
[[gnu::always_inline]] inline Vec3 log_lane(const Mat3& r, Vec3 reference) {
  const Vec3 s = 0.5F * Vec3{r.y.z - r.z.y, r.z.x - r.x.z, r.x.y - r.y.x};  // sin θ · axis
  const float sine = std::sqrt(dot(s, s)), cosine = 0.5F * (r.x.x + r.y.y + r.z.z - 1.0F);
  const bool turned = sine > 1e-6F;
  const float theta = atan2_lane(sine, cosine);
  const float along = dot(s, reference) / sine;  // on the axis
  const float turns = round_lane((along - theta) * 0.15915494F);
  const float factor = (theta + turns * 6.28318531F) / sine;
  return (turned ? factor : 1.0F) * s;
}

/// The smallest rotation that takes direction a to b (unit vectors, not opposite), applied to m.
[[gnu::always_inline]] inline Mat3 turn_lane(Vec3 a, Vec3 b, const Mat3& m) {
  const Vec3 v = cross(a, b);
  const float k = 1.0F / (1.0F + dot(a, b));
  auto turn = [v, k](Vec3 p) {
    const Vec3 q = cross(v, p);
    return p + (q + k * cross(v, q));
  };
  return {turn(m.x), turn(m.y), turn(m.z)};
}

/// A leg of two bones: joint centres [m] and rotations of pelvis P, thigh T, shank S, foot F.
struct LegLane {
  Vec3 hip, knee, ankle;
  Mat3 R_P, R_T, R_S, R_F;
  Vec3 hip_angle, knee_angle, ankle_angle;  ///< axis-angle relative to the parent [rad]
};

/// Puts the ankle at `target` and turns leg and foot by a yaw (its cosine and sine). Hip and knee
/// turn; the foot keeps its orientation but for the yaw, so the ankle's joint takes what is left.
/// The knee turns about its own axis, y of the thigh, and only to flexion: which side it bends to
/// is no matter of where hip and ankle are. The thigh then turns the shortest way.
///
/// A leg within kStretch of its full length gets shorter than asked, by 1.5 mm where it were
/// straight: so the knee, whose angle goes with the root of what is missing, gets no faster than
/// 1/√(kStretch L/2) rad/m, and the leg never straight.
[[gnu::always_inline]] inline void place_foot(Vec3 target, float cos_yaw, float sin_yaw,
                                              LegLane& leg) {
  constexpr float kStretch = 0.003F;  // m
  auto yawed = [cos_yaw, sin_yaw](Vec3 v) {
    return Vec3{cos_yaw * v.x - sin_yaw * v.y, sin_yaw * v.x + cos_yaw * v.y, v.z};
  };
  // in the thigh's frame
  const Vec3 k = transposed_times(leg.R_T, leg.knee - leg.hip);
  const Vec3 a = transposed_times(leg.R_T, leg.ankle - leg.knee);
  const Mat3 bend = transposed_times(leg.R_T, leg.R_S);
  const Mat3 R_T0{yawed(leg.R_T.x), yawed(leg.R_T.y), yawed(leg.R_T.z)};
  const Mat3 R_F{yawed(leg.R_F.x), yawed(leg.R_F.y), yawed(leg.R_F.z)};
  const Vec3 to = target - leg.hip;
  const float wanted = std::sqrt(dot(to, to));
  const float l1 = std::sqrt(k.x * k.x + k.z * k.z), l2 = std::sqrt(a.x * a.x + a.z * a.z);
  const float fixed =
      k.x * k.x + k.y * k.y + k.z * k.z + a.x * a.x + a.y * a.y + a.z * a.z + 2.0F * k.y * a.y;
  const float product = l1 * l2, longest = std::sqrt(fixed + 2.0F * product);
  const float free = longest - kStretch, x = (wanted - free) * (1.0F / kStretch);
  const float reach = x > 0.0F ? free + kStretch * (x / (1.0F + x)) : wanted;
  // law of cosines: flexion to have, and flexion as it was
  float c = (reach * reach - fixed) / (2.0F * product);
  c = c > 1.0F ? 1.0F : c;
  c = c < -0.9F ? -0.9F : c;
  const float s = std::sqrt(1.0F - c * c), per = 1.0F / product;
  const float c0 = (k.x * a.x + k.z * a.z) * per, s0 = (k.z * a.x - k.x * a.z) * per;
  const float ct = c * c0 + s * s0, st = s * c0 - c * s0;
  auto flexed = [ct, st](Vec3 v) { return Vec3{ct * v.x + st * v.z, v.y, ct * v.z - st * v.x}; };
  const Vec3 shank = flexed(a), along = R_T0 * (k + shank);
  const Mat3 R_TS{flexed(bend.x), flexed(bend.y), flexed(bend.z)};
  const float size = std::sqrt(dot(along, along));
  const Mat3 R_T = turn_lane((1.0F / size) * along, (1.0F / wanted) * to, R_T0);
  const Mat3 R_S = R_T * R_TS;
  leg.hip_angle = log_lane(transposed_times(leg.R_P, R_T), leg.hip_angle);
  leg.knee_angle = log_lane(R_TS, leg.knee_angle);
  leg.ankle_angle = log_lane(transposed_times(R_S, R_F), leg.ankle_angle);
  leg.knee = leg.hip + R_T * k;
  leg.ankle = leg.knee + R_T * shank;
  leg.R_T = R_T;
  leg.R_S = R_S;
  leg.R_F = R_F;
}

/// Share of the heel in the point a foot rests on, by the heights of heel and toe: within 2 cm both
/// carry.
inline float heel_share_lane(float heel_z, float toe_z) {
  constexpr float kFlat = 0.02F;  // m
  float u = 0.5F + (toe_z - heel_z) * (0.5F / kFlat);
  u = u > 0.0F ? u : 0.0F;
  u = u < 1.0F ? u : 1.0F;
  return u * u * (3.0F - 2.0F * u);
}

/// Height of the sole's lowest point: of the lower of heel and toe, rounded where they change over
/// within kRound, exact for a flat foot, 1 mm above the point elsewhere.
inline float sole_lane(float heel_z, float toe_z) {
  constexpr float kRound = 0.004F;  // m
  const float apart = heel_z > toe_z ? heel_z - toe_z : toe_z - heel_z;
  const float lower = heel_z < toe_z ? heel_z : toe_z;
  const float in = apart < kRound ? kRound - apart : 0.0F;
  return lower + 0.25F * (kRound - in * in * (1.0F / kRound));
}

}  // namespace mimesis::synthesizer
