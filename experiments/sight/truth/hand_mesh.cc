#include "experiments/sight/truth/hand_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace mimesis::truth {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double deg(double d) { return d * std::numbers::pi / 180.0; }

/// One ellipse of a loft.
struct Ring {
  Vector3d centre;
  Vector3d across, up;  ///< half axes
  float tone;
};

/// Closed surface through rings, with a pole at either end.
void loft(std::span<const Ring> rings, int around, double exponent, Mesh& out) {
  const auto n = static_cast<std::uint32_t>(around);
  const auto first = static_cast<std::uint32_t>(out.vertices.size());
  const auto add = [&out](const Vector3d& at, float tone) {
    out.vertices.push_back({at.cast<float>(), Eigen::Vector3f::Zero(), tone});
  };
  for (const Ring& r : rings) {
    for (int k = 0; k < around; ++k) {
      const double a = 2.0 * std::numbers::pi * k / around;
      const double c = std::cos(a), s = std::sin(a);
      // superellipse |x|^e + |y|^e = 1: 2 is an ellipse, more is boxier
      const double q =
          exponent == 2.0
              ? 1.0
              : std::pow(std::pow(std::abs(c), exponent) + std::pow(std::abs(s), exponent),
                         -1.0 / exponent);
      add(r.centre + q * c * r.across + q * s * r.up, r.tone);
    }
  }
  const auto pole_a = static_cast<std::uint32_t>(out.vertices.size());
  add(rings.front().centre, rings.front().tone);
  add(rings.back().centre, rings.back().tone);
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    out.triangles.push_back({a, b, c});
    const Eigen::Vector3f cross =
        (out.vertices[b].at - out.vertices[a].at).cross(out.vertices[c].at - out.vertices[a].at);
    for (const std::uint32_t i : {a, b, c}) out.vertices[i].normal += cross;
  };
  const auto last = first + n * static_cast<std::uint32_t>(rings.size() - 1);
  for (std::uint32_t k = 0; k < n; ++k) {
    const std::uint32_t next = (k + 1) % n;
    for (std::uint32_t r = first; r < last; r += n) {
      triangle(r + k, r + n + k, r + next);
      triangle(r + next, r + n + k, r + n + next);
    }
    triangle(pole_a, first + k, first + next);
    triangle(pole_a + 1, last + next, last + k);
  }
  // Outwards, whichever way the rings were given.
  const Vector3d axis = rings.back().centre - rings.front().centre;
  const bool outwards = rings.front().across.cross(rings.front().up).dot(axis) > 0.0;
  for (std::size_t i = first; i < out.vertices.size(); ++i) {
    Eigen::Vector3f& normal = out.vertices[i].normal;
    normal.normalize();
    if (outwards) normal = -normal;
  }
}

/// A chain of phalanges: base frame with x along, bending by a rotation about its y axis.
/// Returns the tip.
Vector3d add_digit(const Isometry3d& base, const std::array<double, 3>& bend_rad,
                   const std::array<double, 3>& length_m, double width_m, double flat, Mesh& out) {
  std::vector<Ring> rings;
  Isometry3d frame = base;
  Matrix3d before = base.linear();
  double width = 0.5 * width_m;
  const auto ring = [&](const Isometry3d& f, const Matrix3d& R, double along, double size,
                        float tone) {
    rings.push_back({f * Vector3d(along, 0.0, 0.0), size * R.col(1), flat * size * R.col(2), tone});
  };
  for (std::size_t k = 0; k < 3; ++k) {
    frame.rotate(AngleAxisd(-bend_rad[k], Vector3d::UnitY()));
    const Matrix3d half =
        Eigen::Quaterniond(before).slerp(0.5, Eigen::Quaterniond(frame.linear())).matrix();
    const double l = length_m[k];
    ring(frame, k == 0 ? frame.linear() : half, 0.0, width, 0.97f);  // a joint
    ring(frame, frame.linear(), 0.3 * l, 0.93 * width, 1.0f);
    const double next = 0.90 * width;
    if (k < 2) {
      ring(frame, frame.linear(), 0.75 * l, 0.90 * next * 1.04, 1.0f);
    } else {
      for (const double s : {0.55, 0.72, 0.84, 0.92, 0.97, 0.995}) {  // round tip
        const double t = std::max(0.0, (s - 0.5) / 0.5);
        ring(frame, frame.linear(), s * l, 0.93 * width * std::sqrt(1.0 - t * t * t), 1.04f);
      }
    }
    before = frame.linear();
    frame = frame * Eigen::Translation3d(l, 0.0, 0.0);
    width = next;
  }
  loft(rings, 14, 2.0, out);
  return frame.translation();
}

/// A bulge of flesh: ellipsoid along a line.
void add_bulge(const Vector3d& from, const Vector3d& to, const Vector3d& across, const Vector3d& up,
               Mesh& out) {
  std::vector<Ring> rings;
  for (const double s : {0.02, 0.1, 0.25, 0.5, 0.75, 0.9, 0.98}) {
    const double r = std::sqrt(1.0 - (2.0 * s - 1.0) * (2.0 * s - 1.0));
    rings.push_back({from + s * (to - from), r * across, r * up, 0.99f});
  }
  loft(rings, 14, 2.0, out);
}

}  // namespace

double draw(std::mt19937_64& random, double least, double most) {
  return least + (most - least) * static_cast<double>(random() >> 11) * 0x1.0p-53;
}

Anatomy Anatomy::drawn(std::mt19937_64& random) {
  const auto in = [&random](double least, double most) { return draw(random, least, most); };
  Anatomy a;
  a.left = (random() & 1) != 0;
  a.length_m = in(0.166, 0.204);
  a.breadth_m = a.length_m * in(0.42, 0.475);
  a.depth_m = a.length_m * in(0.135, 0.165);
  a.wrist_m = a.breadth_m * in(0.66, 0.76);
  a.forearm_m = a.wrist_m * in(1.3, 1.6);
  a.sleeve_m = in(0.0, 1.0) < 0.5 ? in(0.015, 0.09) : 1.0;
  // Knuckles as shares of the length, then what is left for the finger.
  constexpr std::array<double, 4> kAlong{0.475, 0.478, 0.452, 0.418};
  constexpr std::array<double, 4> kReach{0.955, 1.0, 0.945, 0.80};
  constexpr std::array<double, 4> kSide{0.345, 0.115, -0.115, -0.335};
  constexpr std::array<double, 4> kSplay{4.0, 0.5, -4.0, -9.0};
  constexpr std::array<double, 4> kWidth{1.0, 1.02, 0.95, 0.83};
  const double stretch = in(-0.02, 0.02), width = a.breadth_m * in(0.235, 0.265);
  for (std::size_t i = 0; i < 4; ++i) {
    Finger& f = a.fingers[i];
    f.along_m = a.length_m * (kAlong[i] - stretch + in(-0.008, 0.008));
    f.side_m = a.breadth_m * (kSide[i] + in(-0.012, 0.012));
    const double reach = i == 1 ? 1.0 : kReach[i] + in(-0.02, 0.02);
    const double length = a.length_m * reach - f.along_m;
    const double proximal = in(0.455, 0.50), middle = in(0.275, 0.31);
    f.length_m = {proximal * length, middle * length, (1.0 - proximal - middle) * length};
    f.width_m = width * kWidth[i];
    f.flat = in(0.86, 0.98);
    f.splay_rad = deg(kSplay[i] + in(-1.5, 1.5));
  }
  const double thumb = a.length_m * in(0.57, 0.63), metacarpal = in(0.39, 0.43);
  a.thumb_m = {metacarpal * thumb, 0.32 * thumb, (0.68 - metacarpal) * thumb};
  a.thumb_width_m = width * in(1.08, 1.2);
  a.thumb_turn_rad = deg(in(35.0, 62.0));
  return a;
}

void build_hand(const Anatomy& a, const Gesture& g, Mesh& out) {
  out.vertices.clear();
  out.triangles.clear();
  const double side = a.left ? 1.0 : -1.0;  // y axis points to the thumb of a left hand
  const Vector3d wrist(-0.5 * a.fingers[1].along_m, 0.0, 0.0);
  const auto knuckle = [&](const Anatomy::Finger& f) -> Vector3d {
    return wrist + Vector3d(f.along_m, side * f.side_m, 0.0);
  };

  std::vector<Ring> palm;
  const double to_knuckles = a.fingers[1].along_m;
  constexpr std::array<std::array<double, 4>, 8> kPalm{{{-0.04, 0.33, 0.40, 0.00},
                                                        {0.00, 0.352, 0.43, 0.00},
                                                        {0.15, 0.39, 0.47, 0.005},
                                                        {0.40, 0.435, 0.50, 0.01},
                                                        {0.70, 0.475, 0.47, 0.005},
                                                        {0.90, 0.487, 0.43, 0.0},
                                                        {1.02, 0.46, 0.36, 0.0},
                                                        {1.10, 0.36, 0.22, 0.0}}};
  for (const auto& [along, half, thick, shift] : kPalm) {
    // the row of knuckles recedes towards the little finger
    const double slant = along > 0.5 ? 0.13 * (along - 0.5) : 0.0;
    palm.push_back({wrist + Vector3d(along * to_knuckles, -side * shift * a.breadth_m, 0.0),
                    a.breadth_m * half * Vector3d(side * slant, 1.0, 0.0),
                    a.depth_m * thick * Vector3d::UnitZ(), 1.0f});
  }
  loft(palm, 24, 2.5, out);
  const Vector3d little = knuckle(a.fingers[3]);
  add_bulge(wrist + Vector3d(-0.003, -side * 0.22 * a.breadth_m, 0.15 * a.depth_m),
            little + Vector3d(-0.004, 0.0, 0.1 * a.depth_m), {0.0, 0.16 * a.breadth_m, 0.0},
            {0.0, 0.0, 0.46 * a.depth_m}, out);

  for (std::size_t i = 0; i < 4; ++i) {
    const Anatomy::Finger& f = a.fingers[i];
    const auto& q = g.fingers[i];
    Isometry3d base = Isometry3d::Identity();
    base.translate(knuckle(f));
    base.rotate(AngleAxisd(side * (f.splay_rad + q[0]), Vector3d::UnitZ()));
    out.tips[i + 1] = add_digit(base, {q[1], q[2], q[3]}, f.length_m, f.width_m, f.flat, out);
  }

  // Thumb: out of the palm's plane, then across it; it bends in a plane turned about its own axis.
  Isometry3d thumb = Isometry3d::Identity();
  thumb.translate(wrist +
                  Vector3d(0.055 * a.length_m, side * 0.27 * a.breadth_m, 0.22 * a.depth_m));
  thumb.rotate(AngleAxisd(side * (deg(48.0) - g.thumb[1]), Vector3d::UnitZ()));
  thumb.rotate(AngleAxisd(-g.thumb[0], Vector3d::UnitY()));
  thumb.rotate(AngleAxisd(side * a.thumb_turn_rad, Vector3d::UnitX()));
  const Isometry3d joint = thumb * Eigen::Translation3d(a.thumb_m[0], 0.0, 0.0);
  add_bulge(thumb * Vector3d(-0.012, 0.0, 0.0), thumb * Vector3d(a.thumb_m[0] + 0.008, 0.0, 0.0),
            0.72 * a.thumb_width_m * thumb.linear().col(1),
            0.70 * a.thumb_width_m * thumb.linear().col(2), out);
  out.tips[0] =
      add_digit(thumb, {0.0, g.thumb[2], g.thumb[3]}, a.thumb_m, a.thumb_width_m, 0.9, out);
  // the web between thumb and index
  add_bulge(0.6 * wrist + 0.4 * joint.translation(),
            0.45 * joint.translation() + 0.55 * knuckle(a.fingers[0]),
            0.10 * a.length_m * Vector3d(0.6, side * 0.3, 0.0), {0.0, 0.0, 0.28 * a.depth_m}, out);

  Isometry3d arm = Isometry3d::Identity();
  arm.translate(wrist);
  arm.rotate(AngleAxisd(std::numbers::pi + side * g.wrist[1], Vector3d::UnitZ()));
  arm.rotate(AngleAxisd(g.wrist[0], Vector3d::UnitY()));
  const auto arm_ring = [&](double along, double half, double flat, float tone) {
    return Ring{arm * Vector3d(along, 0.0, 0.0), half * arm.linear().col(1),
                flat * half * arm.linear().col(2), tone};
  };
  const auto breadth = [&](double along) {
    return 0.5 * (a.wrist_m + (a.forearm_m - a.wrist_m) * std::min(along / 0.2, 1.0));
  };
  std::vector<Ring> rings;
  for (const double s : {-0.012, 0.0, 0.02, 0.05, 0.1, 0.16, 0.22, 0.3, 0.45}) {
    rings.push_back(
        arm_ring(s, breadth(std::max(s, 0.0)), 0.72 + 0.2 * std::max(s, 0.0) / 0.45, 1.0f));
  }
  loft(rings, 20, 2.0, out);
  if (a.sleeve_m < 0.3) {
    rings.clear();
    for (const double s : {0.0, 0.004, 0.05, 0.12, 0.2, 0.3, 0.46}) {
      const double along = a.sleeve_m + s;
      rings.push_back(arm_ring(along, breadth(along) + 0.007 + 0.03 * s, 0.85, 0.0f));
    }
    loft(rings, 20, 2.0, out);
  }
}

}  // namespace mimesis::truth
