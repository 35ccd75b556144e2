#include "nodes/synthesizer/sequence/performer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/so3.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr double kStretch = 0.990;       // largest share of the leg: a knee is never quite straight
constexpr double kStandStretch = 0.985;  // share of the leg that carries
constexpr double kArmStretch = 0.93;     // share of the arm at a grasp

SmoothCurve progress(const TrialPlan& p, const TrialTimes& t) {
  const double length = p.normal_length_m, v = length / t.t1;
  return SmoothCurve({-t.t1, -0.5 * t.t1, 0.0, 0.5 * t.t1, t.t1, t.right_strike, t.reached},
                     {-length, -0.5 * length, 0.0, 0.5 * length, length,
                      length + 0.76 * p.reaching_length_m, length + p.reaching_length_m},
                     v, 0.0);
}

}  // namespace

Performer::Performer(const mocap::Body& body, const TrialPlan& plan, const Drawer& drawer)
    : body_(body),
      plan_(plan),
      drawer_(drawer),
      times_(plan),
      left_(body, mocap::kLeft, prints_of(mocap::kLeft, plan, times_), plan.manner.clearance_m,
            plan.manner.toe_out_rad),
      right_(body, mocap::kRight, prints_of(mocap::kRight, plan, times_), plan.manner.clearance_m,
             -plan.manner.toe_out_rad),
      progress_(progress(plan, times_)),
      phase_({-1.5 * times_.t1, -times_.t1, -0.5 * times_.t1, 0.0, 0.5 * times_.t1, times_.t1,
              times_.right_strike, times_.left_strike},
             {-3 * std::numbers::pi, -2 * std::numbers::pi, -std::numbers::pi, 0.0,
              std::numbers::pi, 2 * std::numbers::pi, 3 * std::numbers::pi, 4 * std::numbers::pi},
             2.0 * std::numbers::pi / times_.t1,
             std::numbers::pi / (times_.left_strike - times_.right_strike)) {
  reach_lean_ = plan.manner.lean_rad;
  grasp_lean_ = plan.manner.lean_rad;
}

double Performer::highest_pelvis(double t) const {
  const Matrix3d R = root_rotation(t);
  const Vector3d p = ground_track(t);
  const double leg =
      body_.offset_m[mocap::kLeftKnee].norm() + body_.offset_m[mocap::kLeftAnkle].norm();
  double highest = -body_.offset_m[mocap::kLeftHip].z() - body_.toe_m[0].z() + kStandStretch * leg;
  for (const auto side : {mocap::kLeft, mocap::kRight}) {
    const Vector3d hip =
        R * body_.offset_m[side == mocap::kLeft ? mocap::kLeftHip : mocap::kRightHip];
    const Vector3d ankle = foot(side, t).pose.p_W_ankle;
    const double flat2 = (ankle - p - hip).head<2>().squaredNorm(), reach = kStretch * leg;
    highest =
        std::min(highest, ankle.z() - hip.z() + std::sqrt(std::max(0.0, reach * reach - flat2)));
  }
  return highest;
}

void Performer::lean_to_reach(const std::function<double(double)>& height_m) {
  const double most = 0.9;  // rad
  auto needed = [&](double t, double* lean, double from) {
    for (*lean = from; *lean < most; *lean += 0.005)
      if (stretch(t, height_m(t)) <= kArmStretch) break;
    *lean += plan_.manner.extra_lean_rad;
  };
  grasp_lean_ = 0.0;
  needed(times_.reached, &reach_lean_, plan_.manner.lean_rad);
  needed(times_.done, &grasp_lean_, reach_lean_);
}

Vector3d Performer::ground_track(double t) const {
  const double sway = plan_.manner.sway_m * gait(t) * std::sin(phase_.at(t));
  return {progress_.at(t), sway, 0.0};
}

Eigen::VectorXd Performer::posture(double t, double height_m, double* short_by_m) const {
  Eigen::VectorXd angles = trunk(t);
  Vector3d root = ground_track(t);
  root.z() = height_m;
  auto put = [&](int first, const LimbAngles& limb) {
    for (int i = 0; i < 3; ++i)
      angles.segment<3>(3 * (first + i)) = limb.axis_angle_rad[static_cast<std::size_t>(i)];
    *short_by_m = std::max(*short_by_m, limb.short_by_m);
  };
  const Matrix3d R = root_rotation(t);
  auto leg = [&](mocap::Side side) {
    const FootPose at = foot(side, t).pose;
    return leg_angles(body_, side, R, root, at.p_W_ankle, foot_rotation(at));
  };
  put(mocap::kLeftHip, leg(mocap::kLeft));
  put(mocap::kRightHip, leg(mocap::kRight));
  const auto pose = forward_kinematics(
      body_, std::span<const double, mocap::kBodyRows>(angles.data(), mocap::kBodyRows), root);
  for (const auto side : {mocap::kLeft, mocap::kRight}) {
    const bool left = side == mocap::kLeft;
    const int shoulder = left ? mocap::kLeftShoulder : mocap::kRightShoulder;
    const Vector3d& p = pose.p_WJ[static_cast<std::size_t>(shoulder)];
    put(shoulder, arm_angles(body_, side, pose.R_WJ[mocap::kChest], p, hand(side, t, p),
                             {-0.5, left ? 0.40 : -0.40, -0.7}));
  }
  return angles;
}

Vector3d Performer::handle(double t) const {
  return {plan_.initial_distance_m() - pulled(t), drawer_.handle_lateral_m,
          drawer_.handle_height_m};
}

Vector3d Performer::object(double t) const {
  return {plan_.initial_distance_m() - pulled(t) + plan_.object_depth_m, plan_.object_lateral_m,
          drawer_.object_height_m};
}

double Performer::gait(double t) const {
  return 1.0 - minimum_jerk(t, times_.t1 + 0.25 * times_.t2, times_.t1 + 0.95 * times_.t2);
}

double Performer::reach(double t) const {
  return minimum_jerk(t, times_.t1 + 0.30 * times_.t2, times_.reached);
}

double Performer::grasp(double t) const {
  return minimum_jerk(t, times_.reached + 0.20 * times_.t3, times_.reached + 0.95 * times_.t3);
}

double Performer::pulled(double t) const {
  return drawer_.pull_m *
         minimum_jerk(t, times_.reached + 0.05 * times_.t3, times_.reached + 0.65 * times_.t3);
}

double Performer::lean(double t) const {
  const double to_reach = minimum_jerk(t, times_.t1 + 0.35 * times_.t2, times_.reached);
  const double to_grasp = minimum_jerk(t, times_.reached + 0.15 * times_.t3, times_.done);
  return plan_.manner.lean_rad + (reach_lean_ - plan_.manner.lean_rad) * to_reach +
         (grasp_lean_ - reach_lean_) * to_grasp;
}

double Performer::drift(double t, int row) const {
  return plan_.manner.drift_rad *
         std::sin(2.0 * std::numbers::pi * t / 2.7 + plan_.manner.drift_phase_rad + 1.9 * row);
}

Matrix3d Performer::root_rotation(double t) const {
  const double g = gait(t), phi = phase_.at(t);
  return math::exp_so3({0.0, 0.0, -plan_.manner.pelvis_turn_rad * g * std::cos(phi)}) *
         math::exp_so3({0.0, 0.30 * lean(t), 0.0}) *
         math::exp_so3({plan_.manner.pelvis_list_rad * g * std::sin(phi), 0.0, 0.0});
}

// Root to head: the chest turns and lists against the pelvis, the head looks ahead and then down.
Eigen::VectorXd Performer::trunk(double t) const {
  Eigen::VectorXd a = Eigen::VectorXd::Zero(mocap::kBodyRows);
  const Matrix3d R = root_rotation(t);
  const Vector3d root = math::log_so3(R);
  const double to_right = 0.22 * grasp(t) - 0.18 * reach(t);  // which shoulder is forward
  const double chest_turn = 0.9 * -root.z() + to_right, look_down = 0.30 * reach(t);
  a.segment<3>(0) = root;
  a.segment<3>(3 * mocap::kSpine) << -0.5 * root.x() + drift(t, 0), 0.35 * lean(t) + drift(t, 1),
      -0.8 * root.z() + 0.4 * to_right;
  a.segment<3>(3 * mocap::kChest) << -0.5 * root.x() + drift(t, 2), 0.35 * lean(t) + drift(t, 3),
      chest_turn - 0.4 * to_right;
  a.segment<3>(3 * mocap::kNeck) << drift(t, 4), -0.35 * lean(t) + 0.5 * look_down,
      -0.4 * (chest_turn - 0.8 * root.z() + root.z());
  a.segment<3>(3 * mocap::kHead) << drift(t, 5), -0.35 * lean(t) + 0.5 * look_down,
      -0.5 * (chest_turn - 0.8 * root.z() + root.z());
  return a;
}

// Finger tips: an arm that swings against the legs, drawn to its target.
Vector3d Performer::hand(mocap::Side side, double t, const Vector3d& p_W_shoulder) const {
  const bool left = side == mocap::kLeft;
  const double sign = left ? 1.0 : -1.0, g = gait(t);
  const double pitch =
      -sign * plan_.manner.arm_swing_rad * g * std::cos(phase_.at(t) - 0.15) - 0.05;
  const double elbow = plan_.manner.elbow_rad -
                       0.4 * sign * plan_.manner.arm_swing_rad * g * std::cos(phase_.at(t) - 0.35);
  const double upper = body_.offset_m[mocap::kLeftElbow].norm();
  const double lower = body_.offset_m[mocap::kLeftWrist].norm() + body_.hand_m[0].norm();
  // a little away from the body, by a turn about the way so that the arm keeps its length
  const double down = upper * std::cos(pitch) + lower * std::cos(pitch + elbow), out = 0.12;
  const Vector3d swing =
      p_W_shoulder + Vector3d(upper * std::sin(pitch) + lower * std::sin(pitch + elbow),
                              sign * std::sin(out) * down, -std::cos(out) * down);
  const double s = left ? reach(t) : grasp(t);
  // over the edge of the drawer, not through it
  const Vector3d over(0.0, 0.0, left ? 0.03 : 0.10);
  return (1.0 - s) * swing + s * (left ? handle(t) : object(t)) + 4.0 * s * (1.0 - s) * over;
}

// Largest stretch of the arms that hold something at t.
double Performer::stretch(double t, double height_m) const {
  Eigen::VectorXd angles = trunk(t);
  Vector3d root = ground_track(t);
  root.z() = height_m;
  const auto pose = forward_kinematics(
      body_, std::span<const double, mocap::kBodyRows>(angles.data(), mocap::kBodyRows), root);
  const double arm = body_.offset_m[mocap::kLeftElbow].norm() +
                     body_.offset_m[mocap::kLeftWrist].norm() + body_.hand_m[0].norm();
  double far = (handle(t) - pose.p_WJ[mocap::kLeftShoulder]).norm();
  if (t > times_.reached)
    far = std::max(far, (object(t) - pose.p_WJ[mocap::kRightShoulder]).norm());
  return far / arm;
}

}  // namespace mimesis::synthesizer
