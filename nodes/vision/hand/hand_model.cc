#include "nodes/vision/hand/hand_model.h"

#include <cmath>

namespace mimesis::vision {
namespace {

using Eigen::Vector3d;

constexpr double deg(double d) { return d * std::numbers::pi / 180.0; }

// Bones over the length of the hand [1]: Buchholz et al. 1992, as others quote them; quotations of
// the metacarpals disagree. These start at the wrist.
struct Digit {
  double metacarpal, proximal, middle, distal;
  double side;    // knuckle beside the axis wrist - middle knuckle, + towards the thumb (ours)
  double radius;  // at the knuckle (ours)
  double splay;   // direction at rest [rad] (ours)
};
constexpr std::array<Digit, 4> kFingers{{{0.463, 0.245, 0.143, 0.097, 0.152, 0.055, deg(5)},
                                         {kPalm, 0.266, 0.170, 0.108, 0.048, 0.056, deg(1)},
                                         {0.421, 0.244, 0.165, 0.107, -0.054, 0.053, deg(-4)},
                                         {0.414, 0.204, 0.117, 0.093, -0.150, 0.046, deg(-9)}}};
constexpr double kThumbMetacarpal = 0.251, kThumbProximal = 0.196, kThumbDistal = 0.158;
constexpr double kStretched = kFingers[1].metacarpal + kFingers[1].proximal + kFingers[1].middle +
                              kFingers[1].distal;  // the middle finger's

// Unpublished: places and thicknesses, over the length of the hand [1].
const Vector3d kThumbRoot(0.05, 0.11, 0.03);  // from the wrist
constexpr double kThumbRadius = 0.075, kThumbKnuckle = 0.062, kThumbTip = 0.044;
constexpr double kPalmRadius = 0.066, kHeelRadius = 0.076;
// Wrist and forearm of adults are some 6 and 8.7 cm broad, at a hand of 185 mm.
constexpr double kWristRadius = 0.16, kElbowRadius = 0.235, kForearm = 1.08;

constexpr std::array<JointRange, kHandJoints> kRanges{{
    {deg(-5), deg(65), deg(25)},   // thumb: abduction
    {deg(-25), deg(55), deg(12)},  // across the palm
    {deg(-10), deg(60), deg(20)},  // MCP
    {deg(-15), deg(80), deg(20)},  // IP
    {deg(-15), deg(15), 0.0},     {deg(-10), deg(90), deg(25)}, {0.0, deg(110), deg(30)},
    {0.0, deg(90), deg(20)},      {deg(-15), deg(15), 0.0},     {deg(-10), deg(90), deg(25)},
    {0.0, deg(110), deg(30)},     {0.0, deg(90), deg(20)},      {deg(-15), deg(15), 0.0},
    {deg(-10), deg(90), deg(25)}, {0.0, deg(110), deg(30)},     {0.0, deg(90), deg(20)},
    {deg(-15), deg(15), 0.0},     {deg(-10), deg(90), deg(25)}, {0.0, deg(110), deg(30)},
    {0.0, deg(90), deg(20)},
}};

/// Joints and tip of a digit that bends in the plane of `along` and `towards` (orthonormal).
std::array<Vector3d, 4> bent(const Vector3d& root, const Vector3d& along, const Vector3d& towards,
                             const std::array<double, 3>& length,
                             const std::array<double, 3>& angle) {
  std::array<Vector3d, 4> p;
  p[0] = root;
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    sum += angle[k];
    p[k + 1] = p[k] + length[k] * (std::cos(sum) * along + std::sin(sum) * towards);
  }
  return p;
}

using Digits = std::array<std::array<Vector3d, 4>, 5>;

/// Ratios of a shape to the published one [1].
struct Ratios {
  explicit Ratios(const HandShape& s)
      : palm(std::exp(s.palm)),
        finger((kStretched - kPalm * palm) / (kStretched - kPalm)),
        breadth(std::exp(s.breadth)) {}
  double palm, finger, breadth;
  double wrist() const { return -0.5 * kPalm * palm; }  // on the x axis of H
};

/// Sign of the side in frame H: the thumb is at +y or -y.
double thumb_side(const HandPose& pose) { return pose.left ? 1.0 : -1.0; }

/// Joints in frame H over the length of the hand; thumb first.
Digits joints(const HandPose& pose, const Ratios& ratio) {
  const double side = thumb_side(pose);
  Digits out;
  const auto& q = pose.joint_rad;
  // The thumb's metacarpal points forward and to the side at rest; bending goes half towards the
  // palm and half across it.
  const double azimuth = deg(45) - q[1], up = q[0];
  const Vector3d along(std::cos(up) * std::cos(azimuth), side * std::cos(up) * std::sin(azimuth),
                       std::sin(up));
  const Vector3d across(std::sin(azimuth), -side * std::cos(azimuth), 0.0);
  const Vector3d palmar(-std::sin(up) * std::cos(azimuth), -side * std::sin(up) * std::sin(azimuth),
                        std::cos(up));
  const Vector3d towards = std::sqrt(0.5) * (across + palmar);
  const Vector3d root(ratio.wrist() + kThumbRoot.x(), side * ratio.breadth * kThumbRoot.y(),
                      ratio.breadth * kThumbRoot.z());
  out[0] = bent(root, along, towards, {kThumbMetacarpal, kThumbProximal, kThumbDistal},
                {0.0, q[2], q[3]});
  for (std::size_t i = 0; i < 4; ++i) {
    const Digit& f = kFingers[i];
    const double* angle = q.data() + 4 * (i + 1);
    const double spread = f.splay + angle[0];
    const double metacarpal = ratio.palm * f.metacarpal, beside = ratio.breadth * f.side;
    const Vector3d knuckle(ratio.wrist() + std::sqrt(metacarpal * metacarpal - beside * beside),
                           side * beside, 0.0);
    out[i + 1] = bent(knuckle, {std::cos(spread), side * std::sin(spread), 0.0}, Vector3d::UnitZ(),
                      {ratio.finger * f.proximal, ratio.finger * f.middle, ratio.finger * f.distal},
                      {angle[1], angle[2], angle[3]});
  }
  return out;
}

}  // namespace

const std::array<JointRange, kHandJoints>& hand_joint_ranges() { return kRanges; }

void HandModel::capsules(const HandPose& pose, HandCapsules& out) const {
  const Ratios ratio(pose.shape);
  const Digits digits = joints(pose, ratio);
  const double side = thumb_side(pose);
  const double length_m = this->length_m(pose);
  const Eigen::Matrix3f R = (length_m * pose.R_CH).cast<float>();
  const Eigen::Vector3f t = pose.p_CH.cast<float>();
  auto scale = static_cast<float>(length_m * ratio.breadth);
  std::size_t n = 0;
  const auto add = [&](const Vector3d& a, const Vector3d& b, double radius_a, double radius_b) {
    out[n++] = {R * a.cast<float>() + t, R * b.cast<float>() + t,
                scale * static_cast<float>(radius_a), scale * static_cast<float>(radius_b)};
  };
  for (std::size_t i = 0; i < 4; ++i) {
    // the little finger's side of a palm is nearly straight
    const bool outer = i == 3;
    const Vector3d heel(ratio.wrist() + (outer ? 0.05 : 0.02),
                        (outer ? 0.72 : 0.55) * side * ratio.breadth * kFingers[i].side, 0.0);
    add(heel, digits[i + 1][0], kHeelRadius, kPalmRadius);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& p = digits[i + 1];
    const double r = kFingers[i].radius;
    add(p[0], p[1], r, 0.90 * r);
    add(p[1], p[2], 0.90 * r, 0.81 * r);
    // the tip is round: its ball ends where the bone does
    const double before = 0.7 * 0.74 * r * ratio.breadth;
    add(p[2], p[3] - before * (p[3] - p[2]).normalized(), 0.81 * r, 0.74 * r);
  }
  const auto& thumb = digits[0];
  add(thumb[0], thumb[1], kThumbRadius, kThumbKnuckle);
  add(thumb[1], thumb[2], kThumbKnuckle, 0.9 * kThumbKnuckle);
  add(thumb[2], thumb[3] - 0.7 * kThumbTip * ratio.breadth * (thumb[3] - thumb[2]).normalized(),
      0.9 * kThumbKnuckle, kThumbTip);
  add(0.5 * (thumb[0] + thumb[1]), 0.75 * digits[1][0] + 0.25 * thumb[0], 0.06, 0.055);  // web
  const double flexion = pose.wrist_rad[0], deviation = pose.wrist_rad[1];
  scale = static_cast<float>(length_m);  // the forearm has a shape of its own
  const Vector3d wrist(ratio.wrist(), 0.0, 0.0);
  const Vector3d back(-std::cos(flexion) * std::cos(deviation), -std::sin(deviation) * side,
                      std::sin(flexion) * std::cos(deviation));
  const double bare = std::exp(pose.arm[2]), at_wrist = kWristRadius * std::exp(pose.arm[0]),
               at_elbow = kElbowRadius * std::exp(pose.arm[1]);
  const double taper = std::min(bare, kForearm);
  const double at_end = at_wrist + taper / kForearm * (at_elbow - at_wrist);
  add(wrist + 0.04 * back, wrist + (0.04 + taper) * back, at_wrist, at_end);
  const double more = bare > kForearm ? at_end : 0.0;
  add(wrist + (0.04 + taper) * back, wrist + (0.04 + bare) * back, more, more);
}

std::array<Vector3d, 5> HandModel::tips(const HandPose& pose) const {
  const Digits digits = joints(pose, Ratios(pose.shape));
  std::array<Vector3d, 5> out;
  for (std::size_t i = 0; i < 5; ++i) {
    out[i] = pose.p_CH + length_m(pose) * (pose.R_CH * digits[i][3]);
  }
  return out;
}

Vector3d HandModel::wrist(const HandPose& pose) const {
  return pose.p_CH + length_m(pose) * Ratios(pose.shape).wrist() * pose.R_CH.col(0);
}

}  // namespace mimesis::vision
