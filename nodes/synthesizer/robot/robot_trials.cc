#include "nodes/synthesizer/robot/robot_trials.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/motion/retarget/to_robot.h"
#include "common/robot/drawer_size.h"
#include "common/robot/kinematics.h"
#include "nodes/synthesizer/sequence/performer.h"

namespace mimesis::synthesizer {

namespace {

bool in_leg(const robot::RobotTree& tree, const retarget::RobotFigure& figure, int link) {
  const int pelvis = tree.require_link(figure.pelvis);  // the root, or fixed to it
  for (const std::string& hip : figure.hip) {
    int top = tree.require_link(hip);
    while (tree.link(top).parent > 0 && tree.link(top).parent != pelvis) {
      top = tree.link(top).parent;
    }
    if (tree.carries(top, link)) return true;
  }
  return false;
}

using Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector3d;

/// Values spread evenly over a range, in an order that keeps them apart from the trials' number.
double spread(int i, int n, int stride, double low, double high) {
  return low + (high - low) * ((i * stride) % n) / std::max(1, n - 1);
}

std::vector<TrialPlan> draw_robot_plans(const RobotTrialSettings& s) {
  Draw draw(s.seed);
  std::vector<TrialPlan> plans;
  for (int i = 0; i < s.trials; ++i) {
    TrialPlan p;
    p.recording = i;
    p.normal_length_m = spread(i, s.trials, 1, s.least_normal_m, s.most_normal_m);
    p.reaching_length_m = spread(i, s.trials, 3, s.least_reaching_m, s.most_reaching_m);
    p.object_depth_m = spread(i, s.trials, 7, s.least_depth_m, s.most_depth_m);
    p.object_lateral_m = (i % 2 == 0 ? 0.04 : -0.04) + draw.between(-0.01, 0.01);
    const double deep = (p.object_depth_m - s.least_depth_m) / (s.most_depth_m - s.least_depth_m);
    p.final_distance_m = s.least_reach_m + deep * (s.most_reach_m - s.least_reach_m) -
                         p.object_depth_m + draw.between(-0.02, 0.02);
    p.duration_s[kNormalStep] = p.duration_s[kReachingStep] = s.cycle_s;
    p.duration_s[kStanding] = s.standing_s;
    Manner& m = p.manner;
    m.sway_m = m.pelvis_turn_rad = 0.0;  // the walker's affair
    m.pelvis_list_rad = 0.0;
    m.arm_swing_rad = draw.between(0.20, 0.26);
    m.elbow_rad = draw.between(0.45, 0.55);
    m.lean_rad = draw.between(0.02, 0.06);
    m.extra_lean_rad = draw.between(0.0, 0.02);
    m.drift_rad = draw.between(0.002, 0.006);
    m.drift_phase_rad = draw.between(0.0, 2.0 * std::numbers::pi);
    plans.push_back(p);
  }
  return plans;
}

/// From a person's arms, sideways at zero, to the robot's, hanging.
Matrix3d hanging(std::size_t side) {
  const double angle = (side == 0 ? 0.5 : -0.5) * std::numbers::pi;
  return Eigen::AngleAxisd(angle, Vector3d::UnitX()).toRotationMatrix();
}

class Retargeting {
 public:
  Retargeting(const robot::RobotTree& tree, const retarget::RobotFigure& figure, double height_m)
      : tree_(upper_body_tree(tree, figure)), figure_(figure), height_m_(height_m) {
    for (const std::size_t side : {0u, 1u}) {
      wrist_[side] = tree_.require_link(figure.wrist[side]);
      elbow_[side] = tree_.require_link(figure.elbow[side]);
    }
    chest_ = tree_.require_link(figure.chest);
    head_ = tree_.require_link(figure.head);
    start_.q = Eigen::VectorXd::Zero(tree_.dof());
    for (const auto& [joint, angle] : figure.start_rad) {
      if (const int i = tree_.find_joint(joint); i >= 0) start_.q[i] = angle;
    }
    start_.X_WB.translation().z() = height_m;
  }

  /// Goals of the robot for a person's posture; the pelvis is above the origin.
  retarget::FrameGoals goals(const mocap::BodyPose& pose) const {
    const Vector3d shift = Vector3d(0.0, 0.0, height_m_) - pose.p_WJ[mocap::kRoot];
    const auto at = [&](int joint) {
      return Vector3d(pose.p_WJ[static_cast<std::size_t>(joint)] + shift);
    };
    const auto R = [&](int joint) { return pose.R_WJ[static_cast<std::size_t>(joint)]; };
    retarget::FrameGoals g;
    g.exact.push_back(retarget::goal(0, Matrix3d::Identity(), {0.0, 0.0, height_m_}, 10.0, 10.0));
    g.wishes.push_back(retarget::goal(chest_, R(mocap::kChest), at(mocap::kChest), 0.0, 1.0));
    g.wishes.push_back(retarget::goal(head_, R(mocap::kHead), at(mocap::kHead), 0.0, 0.6));
    for (const std::size_t side : {0u, 1u}) {
      const int wrist = side == 0 ? mocap::kLeftWrist : mocap::kRightWrist;
      const Matrix3d R_WE = R(wrist) * hanging(side);
      g.exact.push_back(retarget::goal(wrist_[side], R_WE, at(wrist) + R_WE * figure_.hand_m[side],
                                       1.0, 0.0, figure_.hand_m[side]));
      g.wishes.push_back(
          retarget::goal(elbow_[side], Matrix3d::Identity(), at(wrist - 1), 1.0, 0.0));
      g.wishes.push_back(retarget::goal(wrist_[side], R_WE, Vector3d::Zero(), 0.0, 0.15));
    }
    return g;
  }

  /// dof × frames.
  MatrixXd follow(const std::vector<retarget::FrameGoals>& goals, RobotTrialReport& report) const {
    retarget::RobotReport ignored;
    const auto postures = retarget::follow(tree_, start_, goals, ignored);
    robot::Kinematics kinematics(tree_);
    MatrixXd q(tree_.dof(), static_cast<Eigen::Index>(postures.size()));
    for (std::size_t t = 0; t < postures.size(); ++t) {
      q.col(static_cast<Eigen::Index>(t)) = postures[t].q;
      kinematics.update(postures[t].X_WB, postures[t].q);
      for (const std::size_t hand : {1u, 2u}) {
        const retarget::Goal& g = goals[t].exact[hand];
        const double off =
            (kinematics.X_WL(g.link) * g.X_LE.translation() - g.X_WE.translation()).norm();
        report.hand_error_m = std::max(report.hand_error_m, off);
      }
    }
    return q;
  }
  const robot::RobotTree& tree() const { return tree_; }

 private:
  robot::RobotTree tree_;
  const retarget::RobotFigure& figure_;
  double height_m_;
  retarget::Posture start_;
  std::array<int, 2> wrist_{}, elbow_{};
  int chest_ = 0, head_ = 0;
};

double sample_time(const TrialPlan& p, int block, int k, int samples) {
  double start = 0.0;
  for (int a = 0; a < block; ++a) start += p.duration_s[a];
  return start + p.duration_s[block] * k / samples;
}

struct Recorded {
  MatrixXd q;         ///< dof × 3T
  MatrixXd velocity;  ///< 3 × 3T
};

Recorded record(const mocap::Body& body, const Retargeting& retargeting, const TrialPlan& plan,
                const Drawer& drawer, double height_m, int samples, RobotTrialReport& report) {
  Performer performer(body, plan, drawer);
  performer.lean_to_reach([&](double) { return height_m; });
  Recorded r;
  r.velocity.resize(3, kActions * samples);
  std::vector<retarget::FrameGoals> goals;
  double ignored = 0.0;
  for (int a = 0; a < kActions; ++a) {
    for (int k = 0; k < samples; ++k) {
      const double t = sample_time(plan, a, k, samples);
      const Eigen::VectorXd angles = performer.posture(t, height_m, &ignored);
      Vector3d root = performer.ground_track(t);
      root.z() = height_m;
      goals.push_back(retargeting.goals(forward_kinematics(
          body, std::span<const double, mocap::kBodyRows>(angles.data(), mocap::kBodyRows), root)));
      const double dt = plan.duration_s[a] / samples;
      const Vector3d v = (performer.ground_track(t + dt) - performer.ground_track(t)) / dt;
      r.velocity.col(a * samples + k) << v.x(), v.y(), 0.0;
    }
  }
  r.q = retargeting.follow(goals, report);
  const Eigen::VectorXd most = retargeting.tree().max_speed();
  for (Eigen::Index t = 1; t < r.q.cols(); ++t) {
    const double dt = plan.duration_s[t / samples] / samples;
    Eigen::Index fastest = 0;
    const double share =
        ((r.q.col(t) - r.q.col(t - 1)) / dt).cwiseAbs().cwiseQuotient(most).maxCoeff(&fastest);
    if (share <= report.speed_share) continue;
    report.speed_share = share;
    report.fastest_joint = retargeting.tree().moved(static_cast<int>(fastest)).joint;
  }
  return r;
}

/// `pace`: of actions 1 and 2.
void append(DrawerData& data, const TrialPlan& p, const Recorded& r, const Paces& pace,
            std::uint64_t seed) {
  const Eigen::Index joints = r.q.rows(), rows = joints + 3;
  const Eigen::Index samples = r.q.cols() / kActions;
  const double reach = p.final_distance_m;
  const double lengths[] = {pace[0] * p.normal_length_m, pace[1] * p.reaching_length_m, 0.0};
  double distance = lengths[0] + lengths[1] + reach;
  for (int a = 0; a < kActions; ++a) {
    mocap::Trials& set = data.action[static_cast<std::size_t>(a)];
    const Eigen::Index first = set.samples.rows();
    set.samples.conservativeResize(first + rows, samples);
    set.samples.middleRows(first, joints) = r.q.middleCols(a * samples, samples);
    set.samples.bottomRows(3) = pace[a == 0 ? 0 : 1] * r.velocity.middleCols(a * samples, samples);
    set.trials.push_back(action_trial(p, a, lengths[a], distance, seed, a * samples, samples));
    distance -= lengths[a];
  }
}

constexpr double kLeg_m = 0.602, kArmsPull_m = 0.20;  // biped.urdf's

/// Scales a length, to the millimetre.
class Scale {
 public:
  explicit Scale(double share) : share_(share) {}
  void operator()(double& length_m) const { length_m = std::round(1e3 * share_ * length_m) / 1e3; }

 private:
  double share_;
};

Scale steps_of(const robot::Biped& biped) {
  return Scale(std::min(1.0, robot::leg_length_m(biped) / kLeg_m));
}

}  // namespace

robot::RobotTree upper_body_tree(const robot::RobotTree& tree,
                                 const retarget::RobotFigure& figure) {
  std::vector<robot::Link> links;
  std::vector<int> number(tree.links().size(), -1);
  for (std::size_t i = 0; i < tree.links().size(); ++i) {
    if (in_leg(tree, figure, static_cast<int>(i))) continue;
    robot::Link link = tree.links()[i];
    if (link.parent >= 0) link.parent = number[static_cast<std::size_t>(link.parent)];
    number[i] = static_cast<int>(links.size());
    links.push_back(std::move(link));
  }
  return {tree.name(), std::move(links)};
}

double easy_pelvis_height(const robot::RobotTree& tree, const retarget::RobotFigure& figure) {
  robot::Kinematics kinematics(tree);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(tree.dof());
  for (const auto& [joint, angle] : figure.start_rad) q[tree.require_joint(joint)] = angle;
  kinematics.update(Eigen::Isometry3d::Identity(), q);
  const auto& X = kinematics.X_WL(tree.require_link(figure.ankle[0]));
  return -(X * figure.heel_m[0]).z();
}

std::vector<std::string> robot_rows(const robot::Biped& biped) {
  std::vector<std::string> rows =
      upper_body_tree(biped.tree, retarget::figure_of(biped)).joint_names();
  rows.insert(rows.end(), kVelocityRows.begin(), kVelocityRows.end());
  return rows;
}

DrawerData generate_robot_data(const robot::Biped& biped, const RobotTrialSettings& settings,
                               RobotTrialReport* report) {
  if (!(settings.cycle_s > 0.2)) throw ConfigError("robot trials: an action of no duration");
  const robot::RobotTree& tree = biped.tree;
  const retarget::RobotFigure figure = retarget::figure_of(biped);
  const Drawer drawer = robot_drawer(biped);
  const double height = easy_pelvis_height(tree, figure);
  const Retargeting retargeting(tree, figure, height);
  DrawerData data{.body = retarget::robot_body(tree, figure), .drawer = drawer, .action = {}};
  for (mocap::Trials& set : data.action) {
    set.rows = robot_rows(biped);
    set.task_names.assign(kTaskNames.begin(), kTaskNames.end());
  }
  RobotTrialReport seen;
  const std::vector<TrialPlan> plans = draw_robot_plans(settings);
  std::vector<Recorded> recorded;
  for (const TrialPlan& p : plans) {
    recorded.push_back(record(data.body, retargeting, p, drawer, height, settings.samples, seen));
  }
  std::vector<Paces> paces = {{1.0, 1.0}};
  for (const double pace : settings.paces) paces.push_back({pace, pace});
  paces.push_back(settings.mixed_pace);
  for (const Paces& pace : paces) {
    for (std::size_t i = 0; i < plans.size(); ++i) {
      append(data, plans[i], recorded[i], pace, settings.seed);
    }
  }
  if (report != nullptr) *report = seen;
  return data;
}

Drawer robot_drawer(const robot::Biped& biped) {
  const robot::DrawerSize size = robot::drawer_size(biped);
  return {.handle_height_m = size.handle_height_m,
          .handle_lateral_m = size.handle_left_m,
          .object_height_m = size.object_height_m,
          .pull_m = size.pull_m};
}

RobotTrialSettings robot_trial_settings(const robot::Biped& biped) {
  const robot::DrawerSize size = robot::drawer_size(biped);
  RobotTrialSettings s;
  s.least_depth_m = size.least_depth_m;
  s.most_depth_m = size.most_depth_m;
  s.least_reach_m = size.least_reach_m;
  s.most_reach_m = size.most_reach_m;
  const Scale scale = steps_of(biped);
  for (double* length :
       {&s.least_normal_m, &s.most_normal_m, &s.least_reaching_m, &s.most_reaching_m}) {
    scale(*length);
  }
  return s;
}

StepPlanSettings robot_step_plan(const robot::Biped& biped) {
  StepPlanSettings s;
  const Scale steps = steps_of(biped);
  for (double* length :
       {&s.normal_m, &s.normal_half_m, &s.reaching_m, &s.reaching_half_m, &s.least_normal_m,
        &s.longest_step_m, &s.shortest_step_m, &s.most_reaching_m, &s.longest_back_m}) {
    steps(*length);
  }
  const Scale arms(robot::drawer_size(biped).pull_m / kArmsPull_m);
  for (double* length : {&s.stand_half_m, &s.stand_nearer_m, &s.stand_farther_m}) arms(*length);
  return s;
}

}  // namespace mimesis::synthesizer
