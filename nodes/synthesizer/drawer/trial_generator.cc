#include "nodes/synthesizer/drawer/trial_generator.h"

#include <limits>
#include <numbers>
#include <string>

#include "common/math/so3.h"
#include "nodes/synthesizer/drawer/smooth.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using mocap::Body;
constexpr double kPi = std::numbers::pi, kNever = std::numeric_limits<double>::infinity();
constexpr double kStretch = 0.990;       // of the leg, at most: a knee is never quite straight
constexpr double kStandStretch = 0.985;  // of the leg that carries
constexpr double kArmStretch = 0.93;     // of the arm at a grasp
constexpr double kHoldAfter = 0.5;       // s

// When things happen in one trial [s], action 1 starts at 0.
struct Times {
  double t1, t2, t3;                 // durations
  double right_strike, left_strike;  // of action 2
  double reached, done;              // ends of actions 2 and 3
  explicit Times(const TrialPlan& p)
      : t1(p.duration_s[0]),
        t2(p.duration_s[1]),
        t3(p.duration_s[2]),
        right_strike(t1 + 0.42 * t2),
        left_strike(t1 + 0.86 * t2),
        reached(t1 + t2),
        done(t1 + t2 + t3) {}
};

// Where the feet end: apart, left in front, since the left hand pulls, and more so after a longer
// step. A short action 2 leaves the left foot nearly where it is and the right one behind.
struct LastPrints {
  double left, right;
  explicit LastPrints(const TrialPlan& p) {
    constexpr double kLeast = 0.03, kSoft = 0.05;  // m
    const double apart = 0.04 + 0.30 * std::max(0.0, p.reaching_length_m - 0.2);
    const double end = p.normal_length_m + p.reaching_length_m;
    const double front =
        0.5 * (1.0 - p.manner.first_step_share) * p.normal_length_m + p.normal_length_m;
    left = front + kLeast + kSoft * std::log1p(std::exp((end + apart - front - kLeast) / kSoft));
    right = 2.0 * end - left;
  }
};

std::vector<Footprint> prints_of(mocap::Side side, const TrialPlan& p, const Times& t) {
  const double length = p.normal_length_m, t1 = t.t1;
  const double left0 = 0.5 * (1.0 - p.manner.first_step_share) * length;
  const double right0 = left0 + p.manner.first_step_share * length - length;  // before action 1
  const LastPrints last(p);
  const bool left = side == mocap::kLeft;
  const double y = left ? p.manner.half_width_m : -p.manner.half_width_m;
  // strike, and the other foot's strike after it, after which this one may lift
  struct Stand {
    double x, strike, other;
  };
  const std::vector<Stand> stands = left ? std::vector<Stand>{{left0 - length, -t1, -0.5 * t1},
                                                              {left0, 0.0, 0.5 * t1},
                                                              {left0 + length, t1, t.right_strike},
                                                              {last.left, t.left_strike, kNever}}
                                         : std::vector<Stand>{{right0 - length, -1.5 * t1, -t1},
                                                              {right0, -0.5 * t1, 0.0},
                                                              {right0 + length, 0.5 * t1, t1},
                                                              {last.right, t.right_strike, kNever}};
  std::vector<Footprint> prints;
  for (std::size_t i = 0; i < stands.size(); ++i) {
    // feet roll with long strides and are put down flat with short ones
    auto roll = [&](std::size_t k) {
      const double stride = k == 0              ? length
                            : k < stands.size() ? stands[k].x - stands[k - 1].x
                                                : 0.0;
      return std::clamp(stride / 1.4, 0.15, 1.0);
    };
    const double lift = stands[i].other + 0.11 * t1;
    prints.push_back({.x_m = stands[i].x,
                      .y_m = y,
                      .strike_s = stands[i].strike,
                      .flat_s = stands[i].strike + 0.10 * t1,
                      .heel_off_s = lift - 0.31 * t1,
                      .lift_s = lift,
                      .strike_pitch_rad = -0.30 * roll(i),
                      .lift_pitch_rad = 0.95 * roll(i + 1)});
  }
  return prints;
}

// The trunk and the limbs as functions of time.
class Performer {
 public:
  Performer(const Body& body, const TrialPlan& plan, const Drawer& drawer)
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
               {-3 * kPi, -2 * kPi, -kPi, 0.0, kPi, 2 * kPi, 3 * kPi, 4 * kPi},
               2.0 * kPi / times_.t1, kPi / (times_.left_strike - times_.right_strike)) {
    reach_lean_ = plan.manner.lean_rad;
    grasp_lean_ = plan.manner.lean_rad;
  }

  const Times& times() const { return times_; }
  FootState foot(mocap::Side side, double t) const {
    return side == mocap::kLeft ? left_.at(t) : right_.at(t);
  }

  // Highest pelvis that both legs allow at t, W.
  double highest_pelvis(double t) const {
    const Matrix3d R = root_rotation(t);
    const Vector3d p = ground_track(t);
    const double leg =
        body_.offset_m[mocap::kLeftKnee].norm() + body_.offset_m[mocap::kLeftAnkle].norm();
    double highest =
        -body_.offset_m[mocap::kLeftHip].z() - body_.toe_m[0].z() + kStandStretch * leg;
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

  // Leans as far as both grasps need. `height_m(t)`: of the pelvis.
  template <typename Height>
  void lean_to_reach(Height height_m) {
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

  Vector3d ground_track(double t) const {
    const double sway = plan_.manner.sway_m * gait(t) * std::sin(phase_.at(t));
    return {progress_.at(t), sway, 0.0};
  }

  // All 17 joints, and the worst miss of a target.
  Eigen::VectorXd posture(double t, double height_m, double* short_by_m) const {
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

  Vector3d handle(double t) const {
    return {plan_.initial_distance_m() - pulled(t), drawer_.handle_lateral_m,
            drawer_.handle_height_m};
  }
  Vector3d object(double t) const {
    return {plan_.initial_distance_m() - pulled(t) + plan_.object_depth_m, plan_.object_lateral_m,
            drawer_.object_height_m};
  }

 private:
  static SmoothCurve progress(const TrialPlan& p, const Times& t) {
    const double length = p.normal_length_m, v = length / t.t1;
    return SmoothCurve({-t.t1, -0.5 * t.t1, 0.0, 0.5 * t.t1, t.t1, t.right_strike, t.reached},
                       {-length, -0.5 * length, 0.0, 0.5 * length, length,
                        length + 0.76 * p.reaching_length_m, length + p.reaching_length_m},
                       v, 0.0);
  }

  // How much walking is left in the movement: 1 to 0.
  double gait(double t) const {
    return 1.0 - minimum_jerk(t, times_.t1 + 0.25 * times_.t2, times_.t1 + 0.95 * times_.t2);
  }
  double reach(double t) const {  // of the left hand
    return minimum_jerk(t, times_.t1 + 0.30 * times_.t2, times_.reached);
  }
  double grasp(double t) const {  // of the right hand
    return minimum_jerk(t, times_.reached + 0.20 * times_.t3, times_.reached + 0.95 * times_.t3);
  }
  double pulled(double t) const {  // m
    return drawer_.pull_m *
           minimum_jerk(t, times_.reached + 0.05 * times_.t3, times_.reached + 0.65 * times_.t3);
  }
  double lean(double t) const {
    const double to_reach = minimum_jerk(t, times_.t1 + 0.35 * times_.t2, times_.reached);
    const double to_grasp = minimum_jerk(t, times_.reached + 0.15 * times_.t3, times_.done);
    return plan_.manner.lean_rad + (reach_lean_ - plan_.manner.lean_rad) * to_reach +
           (grasp_lean_ - reach_lean_) * to_grasp;
  }
  double drift(double t, int row) const {
    return plan_.manner.drift_rad *
           std::sin(2.0 * kPi * t / 2.7 + plan_.manner.drift_phase_rad + 1.9 * row);
  }

  Matrix3d root_rotation(double t) const {
    const double g = gait(t), phi = phase_.at(t);
    return math::exp_so3({0.0, 0.0, -plan_.manner.pelvis_turn_rad * g * std::cos(phi)}) *
           math::exp_so3({0.0, 0.30 * lean(t), 0.0}) *
           math::exp_so3({plan_.manner.pelvis_list_rad * g * std::sin(phi), 0.0, 0.0});
  }

  // Root to head: the chest turns and lists against the pelvis, the head looks ahead and then down.
  Eigen::VectorXd trunk(double t) const {
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
  Vector3d hand(mocap::Side side, double t, const Vector3d& p_W_shoulder) const {
    const bool left = side == mocap::kLeft;
    const double sign = left ? 1.0 : -1.0, g = gait(t);
    const double pitch =
        -sign * plan_.manner.arm_swing_rad * g * std::cos(phase_.at(t) - 0.15) - 0.05;
    const double elbow = plan_.manner.elbow_rad - 0.4 * sign * plan_.manner.arm_swing_rad * g *
                                                      std::cos(phase_.at(t) - 0.35);
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
  double stretch(double t, double height_m) const {
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

  const Body& body_;
  const TrialPlan& plan_;
  const Drawer& drawer_;
  Times times_;
  FootPath left_, right_;
  SmoothCurve progress_, phase_;
  double reach_lean_ = 0.0, grasp_lean_ = 0.0;
};

Eigen::VectorXd sample_times(const Times& t, int samples) {
  const double starts[] = {-t.t1, 0.0, t.t1, t.reached, t.done, t.done + kHoldAfter};
  Eigen::VectorXd times(5 * samples);
  for (int a = 0; a < 5; ++a)
    for (int k = 0; k < samples; ++k)
      times(a * samples + k) = starts[a] + (starts[a + 1] - starts[a]) * k / samples;
  return times;
}

// The pelvis rises and falls as the legs allow: the lower envelope of what they allow, rounded, but
// never above it (the mean over a window of the least over the same window).
Eigen::VectorXd rounded_below(const Eigen::VectorXd& highest, int window) {
  const auto n = highest.size();
  auto over_window = [n](const Eigen::VectorXd& x, int half, bool least) {
    Eigen::VectorXd y(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto from = std::max<Eigen::Index>(0, i - half), to = std::min(n - 1, i + half);
      const auto part = x.segment(from, to - from + 1);
      y(i) = least ? part.minCoeff() : part.mean();
    }
    return y;
  };
  return over_window(over_window(over_window(highest, 2 * window, true), window, false), window,
                     false);
}

}  // namespace

RenderedTrial render(const Body& body, const TrialPlan& plan, const Drawer& drawer, int samples) {
  Performer performer(body, plan, drawer);
  RenderedTrial r;
  r.time_s = sample_times(performer.times(), samples);
  const auto n = r.time_s.size();
  Eigen::VectorXd height(n);
  for (int pass = 0; pass < 2; ++pass) {  // the lean moves the hips a little, hence the height
    Eigen::VectorXd highest(n);
    for (Eigen::Index i = 0; i < n; ++i) highest(i) = performer.highest_pelvis(r.time_s(i));
    height = rounded_below(highest, std::max(1, samples / 22));
    performer.lean_to_reach([&](double t) {
      const auto i = std::lower_bound(r.time_s.begin(), r.time_s.end(), t) - r.time_s.begin();
      return height(std::min<Eigen::Index>(i, n - 1));
    });
  }
  r.angle_rad.resize(mocap::kBodyRows, n);
  r.pelvis_W_m.resize(3, n);
  r.handle_W_m.resize(3, n);
  r.object_W_m.resize(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = r.time_s(i);
    r.angle_rad.col(i) = performer.posture(t, height(i), &r.short_by_m);
    r.pelvis_W_m.col(i) = performer.ground_track(t) + Vector3d(0.0, 0.0, height(i));
    r.contact.push_back(
        {performer.foot(mocap::kLeft, t).contact, performer.foot(mocap::kRight, t).contact});
    r.handle_W_m.col(i) = performer.handle(t);
    r.object_W_m.col(i) = performer.object(t);
  }
  for (Eigen::Index i = 1; i < n; ++i)  // axis-angle without jumps
    for (int j = 0; j < mocap::kBodyJoints; ++j) {
      const Vector3d before = r.angle_rad.block<3, 1>(3 * j, i - 1);
      const Vector3d now = r.angle_rad.block<3, 1>(3 * j, i);
      r.angle_rad.block<3, 1>(3 * j, i) = math::nearest_axis_angle(now, before);
    }
  return r;
}

DrawerData generate_drawer_data(const Body& body, const Drawer& drawer,
                                const GeneratorSettings& settings) {
  const auto plans = draw_plans(settings);
  const Eigen::Index samples = settings.samples;
  DrawerData data{.body = body, .drawer = drawer, .action = {}};
  for (auto& set : data.action) {
    for (int row = 0; row < mocap::kBodyRows; ++row) set.rows.push_back(mocap::body_row_name(row));
    for (const char* row : {"pelvis.x", "pelvis.y", "pelvis.z"}) set.rows.emplace_back(row);
    set.task_names.assign(kTaskNames.begin(), kTaskNames.end());
    set.samples.resize(static_cast<Eigen::Index>(plans.size()) * kDrawerRows, samples);
  }
  for (std::size_t i = 0; i < plans.size(); ++i) {
    const TrialPlan& p = plans[i];
    const RenderedTrial r = render(body, p, drawer, settings.samples);
    double distance = p.initial_distance_m();
    for (int a = 0; a < kActions; ++a) {
      auto& set = data.action[static_cast<std::size_t>(a)];
      const double length = a == kNormalStep     ? p.normal_length_m
                            : a == kReachingStep ? p.reaching_length_m
                                                 : 0.0;
      const auto first = (a + 1) * samples;
      auto block = set.samples.middleRows(static_cast<Eigen::Index>(i) * kDrawerRows, kDrawerRows);
      block.topRows(mocap::kBodyRows) = r.angle_rad.middleCols(first, samples);
      block.bottomRows(kPelvisRows) = r.pelvis_W_m.middleCols(first, samples);
      const double start = r.pelvis_W_m(0, first);
      for (Eigen::Index k = 0; k < samples; ++k)
        block(mocap::kBodyRows, k) -=
            start + length * static_cast<double>(k) / static_cast<double>(samples);
      set.trials.push_back(
          {.clip = "generated " + std::to_string(settings.seed) + "/" + std::to_string(p.recording),
           .style =
               std::array{"normal step", "reaching step", "standing"}[static_cast<std::size_t>(a)],
           .cycle = a,
           .first_frame = first,
           .last_frame = first + samples - 1,
           .duration_s = p.duration_s[a],
           .step_length_m = length,
           .turn_rad = 0.0,
           .task = {distance, p.final_distance_m, p.object_depth_m, p.object_lateral_m}});
      distance -= length;
    }
  }
  return data;
}

}  // namespace mimesis::synthesizer
