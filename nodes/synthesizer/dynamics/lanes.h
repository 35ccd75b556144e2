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

}  // namespace mimesis::synthesizer
