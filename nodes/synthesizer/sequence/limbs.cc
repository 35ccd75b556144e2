#include "nodes/synthesizer/sequence/limbs.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "nodes/synthesizer/character/smooth.h"
#include "nodes/synthesizer/dynamics/lanes.h"

namespace mimesis::synthesizer {

namespace {

struct TwoLinks {
  Eigen::Vector3d upper, lower;  // unit directions
  Eigen::Vector3d normal;        // normal of their plane: straight direction × bend direction
  double bend_rad;               // between them
  double short_by_m;
};

// A triangle of sides a, b and the way to the target; the middle joint lies on the side of `bend`.
TwoLinks two_links(double a, double b, const Eigen::Vector3d& to_target,
                   const Eigen::Vector3d& bend) {
  const double far = to_target.norm(), reach = a + b;
  const double c = std::clamp(far, std::abs(a - b) + 1e-6, reach);
  const Eigen::Vector3d along = to_target / far;
  const Eigen::Vector3d across = (bend - bend.dot(along) * along).normalized();
  const double at_root = std::acos(std::clamp((a * a + c * c - b * b) / (2.0 * a * c), -1.0, 1.0));
  const double at_tip = std::acos(std::clamp((b * b + c * c - a * a) / (2.0 * b * c), -1.0, 1.0));
  return {.upper = std::cos(at_root) * along + std::sin(at_root) * across,
          .lower = std::cos(at_tip) * along - std::sin(at_tip) * across,
          .normal = along.cross(across),
          .bend_rad = at_root + at_tip,
          .short_by_m = std::max(0.0, far - reach)};
}

Vec3 narrow(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}
Mat3 narrow(const Eigen::Matrix3d& m) {
  return {narrow(Eigen::Vector3d(m.col(0))), narrow(Eigen::Vector3d(m.col(1))),
          narrow(Eigen::Vector3d(m.col(2)))};
}
Eigen::Vector3d wide_of(Vec3 v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

/// A leg as it is, from the hip.
struct LegPosture {
  Eigen::Vector3d to_knee_m, to_ankle_m;
  Eigen::Matrix3d R_W_root, R_W_thigh, R_W_shank, R_W_foot;
  std::array<Eigen::Vector3d, 3> axis_angle_rad = mocap::points_at_origin<3>();
};

/// Its ankle at `to`, from the hip, by place_foot().
LimbAngles placed_leg(const LegPosture& posture, const Eigen::Vector3d& to) {
  LegLane leg{.hip = {0.0F, 0.0F, 0.0F},
              .knee = narrow(posture.to_knee_m),
              .ankle = narrow(posture.to_ankle_m),
              .R_P = narrow(posture.R_W_root),
              .R_T = narrow(posture.R_W_thigh),
              .R_S = narrow(posture.R_W_shank),
              .R_F = narrow(posture.R_W_foot),
              .hip_angle = narrow(posture.axis_angle_rad[0]),
              .knee_angle = narrow(posture.axis_angle_rad[1]),
              .ankle_angle = narrow(posture.axis_angle_rad[2])};
  place_foot(narrow(to), 1.0F, 0.0F, leg);
  const double length = posture.to_knee_m.norm() + (posture.to_ankle_m - posture.to_knee_m).norm();
  return {
      .axis_angle_rad = {wide_of(leg.hip_angle), wide_of(leg.knee_angle), wide_of(leg.ankle_angle)},
      .short_by_m = std::max(0.0, to.norm() - length)};
}

Eigen::Matrix3d frame_of(const Eigen::Vector3d& y, const Eigen::Vector3d& z) {
  Eigen::Matrix3d R;
  R << y.cross(z), y, z;
  return R;
}

double sum_y(const mocap::Body& body, mocap::BodyJoint wrist, mocap::Side side) {
  return std::abs(body.offset_m[wrist].y() + body.hand_m[side].y());
}

}  // namespace

Eigen::Matrix3d foot_rotation(const FootPose& foot) {
  return math::exp_so3({0.0, 0.0, foot.yaw_rad}) * math::exp_so3({0.0, foot.pitch_rad, 0.0});
}

LimbAngles leg_angles(const mocap::Body& body, mocap::Side side, const Eigen::Matrix3d& R_W_root,
                      const Eigen::Vector3d& p_W_root, const Eigen::Vector3d& p_W_ankle,
                      const Eigen::Matrix3d& R_W_foot) {
  const int hip = side == mocap::kLeft ? mocap::kLeftHip : mocap::kRightHip;
  const auto h = static_cast<std::size_t>(hip);
  const Eigen::Vector3d to = p_W_ankle - p_W_root - R_W_root * body.offset_m[h];
  // the foot's x without its pitch, which may be large: across y
  const Eigen::Vector3d toes = R_W_foot.col(1).cross(Eigen::Vector3d::UnitZ()).normalized();
  // the thigh along the leg, its y across the plane in which the knee bends
  const Eigen::Vector3d z = -to.normalized();
  const Eigen::Vector3d y = z.cross(R_W_root.col(0) + toes).normalized();
  Eigen::Matrix3d R_W_thigh;
  R_W_thigh << y.cross(z), y, z;
  const Eigen::Vector3d knee = R_W_thigh * body.offset_m[h + 1];
  return placed_leg({.to_knee_m = knee,
                     .to_ankle_m = knee + R_W_thigh * body.offset_m[h + 2],
                     .R_W_root = R_W_root,
                     .R_W_thigh = R_W_thigh,
                     .R_W_shank = R_W_thigh,
                     .R_W_foot = R_W_foot},
                    to);
}

LimbAngles arm_angles(const mocap::Body& body, mocap::Side side, const Eigen::Matrix3d& R_W_chest,
                      const Eigen::Vector3d& p_W_shoulder, const Eigen::Vector3d& p_W_hand,
                      const Eigen::Vector3d& elbow_W) {
  const bool left = side == mocap::kLeft;
  const double sign = left ? 1.0 : -1.0;
  const double upper = body.offset_m[left ? mocap::kLeftElbow : mocap::kRightElbow].norm();
  const double lower = sum_y(body, left ? mocap::kLeftWrist : mocap::kRightWrist, side);
  const TwoLinks arm = two_links(upper, lower, p_W_hand - p_W_shoulder, elbow_W);
  const Eigen::Matrix3d R_W_upper = frame_of(sign * arm.upper, sign * arm.normal);
  return {
      .axis_angle_rad = {math::log_so3(R_W_chest.transpose() * R_W_upper),
                         Eigen::Vector3d(0.0, 0.0, -sign * arm.bend_rad), Eigen::Vector3d::Zero()},
      .short_by_m = arm.short_by_m};
}

FootPath::FootPath(const mocap::Body& body, mocap::Side side, std::vector<Footprint> prints,
                   double clearance_m, double yaw_rad)
    : prints_(std::move(prints)),
      heel_(body.heel_m[side]),
      toe_(body.toe_m[side]),
      clearance_m_(clearance_m),
      yaw_rad_(yaw_rad) {}

// The ankle when the foot has turned about a ground point of its sole, `pivot` in the ankle's
// frame.
FootPose FootPath::rolled(const Footprint& print, const Eigen::Vector3d& pivot,
                          double pitch_rad) const {
  const Eigen::Matrix3d R_yaw = math::exp_so3({0.0, 0.0, yaw_rad_});
  const Eigen::Matrix3d R_pitch = math::exp_so3({0.0, pitch_rad, 0.0});
  const Eigen::Vector3d flat(print.x_m, print.y_m, -pivot.z());
  return {.p_W_ankle = flat + R_yaw * (pivot - R_pitch * pivot),
          .yaw_rad = yaw_rad_,
          .pitch_rad = pitch_rad};
}

FootState FootPath::standing(const Footprint& print, double t) const {
  if (t < print.flat_s) {
    const double u = (print.flat_s - t) / (print.flat_s - print.strike_s);
    return {rolled(print, heel_, print.strike_pitch_rad * u * u), Contact::heel};
  }
  if (t <= print.heel_off_s) return {rolled(print, heel_, 0.0), Contact::flat};
  const double u = (t - print.heel_off_s) / (print.lift_s - print.heel_off_s);
  return {rolled(print, toe_, print.lift_pitch_rad * u * u), Contact::toe};
}

FootState FootPath::at(double t) const {
  std::size_t k = 0;
  while (k + 1 < prints_.size() && prints_[k + 1].strike_s <= t) ++k;
  const Footprint& from = prints_[k];
  if (t <= from.lift_s) return standing(from, t);
  // in the air: leave and arrive with the velocities of the rolling foot
  const Footprint& to = prints_[k + 1];
  constexpr double kStep = 1e-4;  // [s]
  const FootPose a0 = standing(from, from.lift_s - kStep).pose,
                 a1 = standing(from, from.lift_s).pose;
  const FootPose b0 = standing(to, to.strike_s).pose, b1 = standing(to, to.strike_s + kStep).pose;
  const double duration = to.strike_s - from.lift_s, u = (t - from.lift_s) / duration;
  auto between = [&](double x0, double x1, double y0, double y1) {
    return hermite(t - from.lift_s, duration, x1, (x1 - x0) / kStep, y0, (y1 - y0) / kStep);
  };
  FootState state;
  for (int i = 0; i < 3; ++i)
    state.pose.p_W_ankle(i) =
        between(a0.p_W_ankle(i), a1.p_W_ankle(i), b0.p_W_ankle(i), b1.p_W_ankle(i));
  state.pose.p_W_ankle.z() += clearance_m_ * 16.0 * u * u * (1.0 - u) * (1.0 - u);
  state.pose.pitch_rad = between(a0.pitch_rad, a1.pitch_rad, b0.pitch_rad, b1.pitch_rad);
  state.pose.yaw_rad = yaw_rad_;
  return state;
}

namespace {
constexpr double kRest = 0.004;  // offset and range of x: 0 and 1 are never reached
}

void ArmReach::start(bool to_target, double duration_s) {
  x_ = std::clamp(x_, kRest, 1.0 - kRest);
  const double way = 2.0 * std::log((1.0 - kRest) / kRest);  // u·t from one rest to the other
  u_1_s_ = (to_target ? way : -way) / duration_s;
}

void ArmReach::step(double dt_s) {
  if (u_1_s_ == 0.0) return;
  const double odds = x_ / (1.0 - x_) * std::exp(u_1_s_ * dt_s);
  x_ = std::clamp(odds / (1.0 + odds), kRest, 1.0 - kRest);
}

double ArmReach::share() const { return std::clamp((x_ - kRest) / (1.0 - 2.0 * kRest), 0.0, 1.0); }

double ArmReach::apply(const mocap::Body& body, mocap::Side side, const Eigen::Vector3d& p_W_pelvis,
                       const Eigen::Vector3d& p_W_target,
                       Eigen::Ref<Eigen::VectorXd> angles_rad) const {
  const double x = share();
  if (x == 0.0) return 0.0;
  const int shoulder = side == mocap::kLeft ? mocap::kLeftShoulder : mocap::kRightShoulder;
  const auto s = static_cast<std::size_t>(shoulder);
  const auto pose = forward_kinematics(
      body, std::span<const double, mocap::kBodyRows>(angles_rad.data(), mocap::kBodyRows),
      p_W_pelvis);
  const Eigen::Vector3d gait = pose.point(shoulder + 2, body.hand_m[side]);
  const Eigen::Vector3d hand = gait + x * (p_W_target - gait);
  const Eigen::Vector3d elbow = pose.p_WJ[s + 1] - 0.5 * (pose.p_WJ[s] + gait);
  const LimbAngles arm =
      arm_angles(body, side, pose.R_WJ[mocap::kChest], pose.p_WJ[s], hand, elbow);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d before = angles_rad.segment<3>(3 * (shoulder + i));
    angles_rad.segment<3>(3 * (shoulder + i)) =
        math::nearest_axis_angle(arm.axis_angle_rad[static_cast<std::size_t>(i)], before);
  }
  return arm.short_by_m;
}

namespace {
// A swinging foot passes the ground at 3 cm but with 2 m/s and more; a standing one slides with
// less than 0.4 m/s [reference/motion.md, skating of few sources].
constexpr double kNear = 0.045, kFar = 0.060;   // m
constexpr double kSlow = 0.70, kFast = 1.00;    // m/s
constexpr double kSwitch = 0.004;               // m: height of the other end below
constexpr double kPull = 0.985;                 // share of the leg: the foot has to go along
constexpr double kSoft = 0.978, kMost = 0.999;  // share of the leg: a straight knee would snap
constexpr double kFade = 0.10, kSettle = 0.04;  // s

double softly_limited(double stretch) {
  if (stretch <= kSoft) return stretch;
  return kSoft + (kMost - kSoft) * (1.0 - std::exp(-(stretch - kSoft) / (kMost - kSoft)));
}

}  // namespace

void FootHold::hold(HeldFoot& foot, const std::array<Eigen::Vector3d, 2>& ends_W_m,
                    double dt_s) const {
  if (!foot.seen) foot.before_W_m = ends_W_m;
  foot.seen = true;
  auto height = [&](int end) { return ends_W_m[static_cast<std::size_t>(end)].z(); };
  const int low = height(0) <= height(1) ? 0 : 1;
  const auto l = static_cast<std::size_t>(low);
  const double speed = (ends_W_m[l] - foot.before_W_m[l]).head<2>().norm() / dt_s;
  const Eigen::Vector3d was = foot.before_W_m[l] + foot.offset_m;  // corrected
  foot.before_W_m = ends_W_m;
  const bool stands =
      foot.stands ? height(low) < kFar && speed < kFast : height(low) < kNear && speed < kSlow;
  const bool begins = stands && !foot.stands;
  if (begins || (stands && low != foot.end && height(low) < height(foot.end) - kSwitch)) {
    foot.end = low;
    foot.held_W_m = was;
  }
  foot.stands = stands;
  if (stands) {
    foot.held_W_m.z() *= std::exp(-dt_s / kSettle);
    foot.offset_m = foot.held_W_m - ends_W_m[static_cast<std::size_t>(foot.end)];
  } else {
    foot.offset_m *= std::exp(-dt_s / kFade);
  }
  foot.offset_m.z() = std::max(foot.offset_m.z(), -height(low));
}

void FootHold::apply(const mocap::Body& body, const Eigen::Vector3d& p_W_pelvis, double dt_s,
                     Eigen::Ref<Eigen::VectorXd> angles_rad) {
  const auto pose = forward_kinematics(
      body, std::span<const double, mocap::kBodyRows>(angles_rad.data(), mocap::kBodyRows),
      p_W_pelvis);
  correction_m_ = short_by_m_ = 0.0;
  for (const auto side : {mocap::kLeft, mocap::kRight}) {
    const int hip = side == mocap::kLeft ? mocap::kLeftHip : mocap::kRightHip;
    const auto ankle = static_cast<std::size_t>(hip + 2);
    HeldFoot& foot = foot_[side];
    hold(foot, {pose.point(hip + 2, body.heel_m[side]), pose.point(hip + 2, body.toe_m[side])},
         dt_s);
    const auto h = static_cast<std::size_t>(hip);
    LegPosture leg{.to_knee_m = pose.p_WJ[h + 1] - pose.p_WJ[h],
                   .to_ankle_m = pose.p_WJ[ankle] - pose.p_WJ[h],
                   .R_W_root = pose.R_WJ[mocap::kRoot],
                   .R_W_thigh = pose.R_WJ[h],
                   .R_W_shank = pose.R_WJ[h + 1],
                   .R_W_foot = pose.R_WJ[ankle]};
    const Eigen::Vector3d wanted = leg.to_ankle_m + foot.offset_m;
    const double leg_m = body.offset_m[ankle].norm() + body.offset_m[ankle - 1].norm();
    const double stretch = wanted.norm() / leg_m;
    if (stretch > kPull) foot.stands = false;  // pulled off the ground
    for (int i = 0; i < 3; ++i) {
      leg.axis_angle_rad[static_cast<std::size_t>(i)] = angles_rad.segment<3>(3 * (hip + i));
    }
    const LimbAngles placed = placed_leg(leg, wanted * (softly_limited(stretch) / stretch));
    for (int i = 0; i < 3; ++i) {
      angles_rad.segment<3>(3 * (hip + i)) = placed.axis_angle_rad[static_cast<std::size_t>(i)];
    }
    correction_m_ = std::max(correction_m_, foot.offset_m.norm());
    short_by_m_ = std::max(short_by_m_, wanted.norm() - leg_m);
  }
}

}  // namespace mimesis::synthesizer
