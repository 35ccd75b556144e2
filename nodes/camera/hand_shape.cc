#include "nodes/camera/hand_shape.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

namespace mimesis::camera {
namespace {

using Eigen::Vector3d;

struct Finger {
  double side;                   // of the knuckle, + towards the thumb [m]
  std::array<double, 3> length;  // proximal, middle, distal [m]
  double radius;                 // at the knuckle [m]
};
constexpr std::array<Finger, 4> kFingers{{
    {0.033, {0.045, 0.027, 0.020}, 0.0100},
    {0.011, {0.049, 0.031, 0.020}, 0.0102},
    {-0.011, {0.045, 0.030, 0.020}, 0.0098},
    {-0.032, {0.038, 0.022, 0.018}, 0.0088},
}};
const Vector3d kShoulder(-1.0, 0.42, -0.15);  // out of view, left of the table
constexpr double kKnuckle = 0.085;            // distance wrist - knuckles [m]

/// Direction of each phalange against the palm [rad]: open and closed.
struct Posture {
  std::array<double, 3> open, closed;
};
constexpr double deg(double d) { return d * std::numbers::pi / 180.0; }
constexpr Posture kPrecision{{deg(32), deg(58), deg(72)}, {deg(58), deg(92), deg(106)}};
constexpr Posture kFull{{deg(10), deg(26), deg(36)}, {deg(55), deg(132), deg(185)}};

using Polyline = std::array<Vector3d, 4>;  // thumb: (along, side, normal) [m]
const Polyline kThumbPrecisionOpen{
    {{0.022, 0.026, 0.008}, {0.048, 0.042, 0.030}, {0.056, 0.040, 0.058}, {0.058, 0.034, 0.076}}};
const Polyline kThumbPrecisionClosed{
    {{0.022, 0.026, 0.008}, {0.044, 0.040, 0.032}, {0.050, 0.030, 0.062}, {0.054, 0.020, 0.086}}};
const Polyline kThumbFullOpen{
    {{0.020, 0.026, 0.006}, {0.044, 0.052, 0.012}, {0.066, 0.066, 0.020}, {0.084, 0.070, 0.030}}};
const Polyline kThumbFullClosed{
    {{0.020, 0.026, 0.006}, {0.044, 0.046, 0.028}, {0.062, 0.044, 0.056}, {0.080, 0.034, 0.072}}};

}  // namespace

void hand_capsules(const TeacherPose& pose, Grip grip, std::vector<Capsule>& out) {
  out.clear();
  const Vector3d x = pose.fingers.normalized();
  const Vector3d n = pose.palm_normal.normalized();
  const Vector3d s = n.cross(x);  // towards the thumb of a left hand
  const auto point = [&](double along, double side, double normal) -> Vector3d {
    return pose.wrist + along * x + side * s + normal * n;
  };
  const bool precision = grip == Grip::precision;
  const Posture& posture = precision ? kPrecision : kFull;

  const Vector3d middle = pose.wrist + 0.55 * (pose.elbow - pose.wrist);
  out.push_back({kShoulder, pose.elbow, 0.060, 0.050, false});
  out.push_back({pose.elbow, middle, 0.050, 0.044, false});
  out.push_back({middle, pose.wrist, 0.036, 0.0255, true});
  for (const Finger& f : kFingers) {
    out.push_back(
        {point(0.004, 0.55 * f.side, 0.0), point(kKnuckle, f.side, 0.0), 0.0165, 0.0135, true});
  }
  out.push_back({point(0.02, 0.0, 0.002), point(0.07, 0.0, 0.002), 0.019, 0.017, true});

  for (const Finger& f : kFingers) {
    // In a precision grip index and middle finger reach the object; the others stay curled beside
    // it.
    const double gather = precision ? 0.45 * pose.closure : 0.0;
    Vector3d from(kKnuckle, f.side, 0.0);
    double radius = f.radius;
    for (std::size_t k = 0; k < 3; ++k) {
      const double angle = posture.open[k] + pose.closure * (posture.closed[k] - posture.open[k]);
      Vector3d to = from + f.length[k] * Vector3d(std::cos(angle), 0.0, std::sin(angle));
      to.y() -= gather * (f.side - 0.011) * f.length[k] / 0.095;
      out.push_back({point(from.x(), from.y(), from.z()), point(to.x(), to.y(), to.z()), radius,
                     0.93 * radius, true});
      from = to;
      radius *= 0.93;
    }
  }
  const Polyline& open = precision ? kThumbPrecisionOpen : kThumbFullOpen;
  const Polyline& closed = precision ? kThumbPrecisionClosed : kThumbFullClosed;
  double radius = 0.0145;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3d a = open[k] + pose.closure * (closed[k] - open[k]);
    const Vector3d b = open[k + 1] + pose.closure * (closed[k + 1] - open[k + 1]);
    out.push_back(
        {point(a.x(), a.y(), a.z()), point(b.x(), b.y(), b.z()), radius, 0.84 * radius, true});
    radius *= 0.84;
  }
}

}  // namespace mimesis::camera
