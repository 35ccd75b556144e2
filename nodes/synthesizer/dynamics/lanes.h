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

/// Moves the ankle by (dx, dy) horizontally; the foot keeps its orientation. The knee bends to
/// where it bent before, off the line from hip to ankle as it was: off the new one a nearly
/// straight leg would change sides. A leg that was straight bends to the front of the thigh. A
/// length within kStretch of a straight leg's, L, changes by less than wanted, so that the knee,
/// whose angle goes with the root of what is missing, gets no faster than 1/√(kStretch L/2) rad/m,
/// and the leg never straight.
[[gnu::always_inline]] inline void move_ankle(float dx, float dy, LegLane& leg) {
  constexpr float kStretch = 0.010F;  // m
  const float moved = std::sqrt(dx * dx + dy * dy);
  const Vec3 k = leg.knee - leg.hip, a = leg.ankle - leg.knee, old = leg.ankle - leg.hip;
  const float l1 = std::sqrt(dot(k, k)), l2 = std::sqrt(dot(a, a));
  const float had = std::sqrt(dot(old, old)), free = l1 + l2 - kStretch;
  const Vec3 to = old + Vec3{dx, dy, 0.0F};
  const float wanted = std::sqrt(dot(to, to));
  // y = x/(1 + x) of what lies beyond `free`, both in kStretch
  const float y = (had - free) * (1.0F / kStretch), near = y < 0.9999F ? y : 0.9999F;
  const float x = (near > 0.0F ? near / (1.0F - near) : near) + (wanted - had) * (1.0F / kStretch);
  const float reach = free + kStretch * (x > 0.0F ? x / (1.0F + x) : x);
  const Vec3 n0 = (1.0F / had) * old, n = (1.0F / wanted) * to;
  // law of cosines at the hip
  float c = (l1 * l1 + reach * reach - l2 * l2) / (2.0F * l1 * reach);
  c = c > 1.0F ? 1.0F : c;
  c = c < -1.0F ? -1.0F : c;
  const float s = std::sqrt(1.0F - c * c);
  // side of the knee; of a straight leg, to the front (fading in with the displacement)
  const float part = moved * 100.0F, front = 0.005F * (part < 1.0F ? part : 1.0F);
  const Vec3 bent = k - dot(k, n0) * n0 + front * leg.R_T.x;
  const Vec3 e = bent - dot(bent, n) * n;
  const float size = std::sqrt(dot(e, e));
  const Vec3 knee = leg.hip + l1 * (c * n + (s / (size > 1e-9F ? size : 1e-9F)) * e);
  const Vec3 ankle = leg.hip + reach * n;
  const Mat3 R_T = turn_lane((1.0F / l1) * k, (1.0F / l1) * (knee - leg.hip), leg.R_T);
  const Mat3 R_S = turn_lane((1.0F / l2) * a, (1.0F / l2) * (ankle - knee), leg.R_S);
  leg.hip_angle = log_lane(transposed_times(leg.R_P, R_T), leg.hip_angle);
  leg.knee_angle = log_lane(transposed_times(R_T, R_S), leg.knee_angle);
  leg.ankle_angle = log_lane(transposed_times(R_S, leg.R_F), leg.ankle_angle);
  leg.knee = knee;
  leg.ankle = ankle;
  leg.R_T = R_T;
  leg.R_S = R_S;
}

}  // namespace mimesis::synthesizer
