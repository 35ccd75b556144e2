#include "experiments/walk/study/script.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "experiments/walk/trial/suites.h"
#include "nodes/synthesizer/character/smooth.h"

namespace mimesis::walk {
namespace {

using synthesizer::Action;
using synthesizer::minimum_jerk;
using walker::kTick_s;

constexpr double kLambda_1_s = 20.0, kFade_s = 0.8;  // as in BipedDrawerSequence
// part of action 3 in which the hands' shares grow
constexpr double kGrowFrom = 0.0, kGrowTo = 0.15;
constexpr double kPullTo = 0.65;  // as in the trials
// before a landing, when the pattern generator changes it no more
constexpr double kFrozen_s = 0.1;
// sideways, while it stands: tells the generator which foot begins
constexpr double kRightFirst_m_s = 1e-6;

Action action_of(int number) {
  return number < 2    ? synthesizer::kNormalStep
         : number == 2 ? synthesizer::kReachingStep
                       : synthesizer::kStanding;
}

/// Travel of the pelvis that the velocity rows of actions 1, 1, 2 ask for, until each sample.
Eigen::MatrixXd asked_travel(const ActionRows& rows) {
  const Eigen::Index n = rows[0].cols();
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(3, 3 * n);
  const double dt_s = 2.0 * kStep_s / static_cast<double>(n);
  for (Eigen::Index k = 1; k < out.cols(); ++k) {
    const auto& action = rows[action_of(static_cast<int>((k - 1) / n))];
    out.col(k) = out.col(k - 1) + dt_s * action.col((k - 1) % n).tail<3>();
  }
  return out;
}

}  // namespace

synthesizer::ActionTask DrawerGoal::task() const {
  return {.length_m = 0.0,
          .duration_s = 2.0 * kStep_s,
          .previous_length_m = reaching_m,
          .final_distance_m = final_distance_m,
          .object_depth_m = object_depth_m,
          .object_lateral_m = object_lateral_m};
}

DrawerGoal goal_of(const synthesizer::DrawerData& data, std::size_t trial) {
  const auto& normal = data.action[synthesizer::kNormalStep].trials.at(trial);
  const auto& reaching = data.action[synthesizer::kReachingStep].trials.at(trial);
  return {normal.step_length_m, reaching.step_length_m, normal.task.at(1), normal.task.at(2),
          normal.task.at(3)};
}

ActionRows rows_of(const synthesizer::DrawerData& data, std::size_t trial) {
  ActionRows out;
  for (std::size_t a = 0; a < out.size(); ++a) {
    const Eigen::Index n = data.action[a].rows_per_trial();
    out[a] = data.action[a].samples.middleRows(static_cast<Eigen::Index>(trial) * n, n);
  }
  return out;
}

Eigen::VectorXd at_phase(const Eigen::MatrixXd& rows, double phase) {
  const Eigen::Index n = rows.cols();
  const double at = std::clamp(phase, 0.0, 1.0) * static_cast<double>(n);
  const Eigen::Index i = std::min(static_cast<Eigen::Index>(at), n - 2);
  return rows.col(i) + (at - static_cast<double>(i)) * (rows.col(i + 1) - rows.col(i));
}

ScriptRobot::ScriptRobot(const Robot& r)
    : robot(&r),
      figure(retarget::figure_of(r.biped)),
      upper(synthesizer::upper_body_tree(r.biped.tree, figure)),
      drawer(synthesizer::robot_drawer(r.biped)),
      pelvis_height_m(synthesizer::easy_pelvis_height(r.biped.tree, figure)) {
  for (const int dof : r.biped.upper_body) {
    joint.push_back(upper.require_joint(r.biped.tree.moved(dof).joint));
  }
}

Script::Script(const ScriptRobot& robot, ActionRows rows, const DrawerGoal& goal, Led led)
    : robot_(&robot),
      rows_(std::move(rows)),
      led_(led),
      travel_(asked_travel(rows_)),
      feet_distance_m_(robot.robot->biped.feet_distance_m),
      kinematics_(robot.upper) {
  const double step = 0.5 * goal.normal_m, last = 3.5 * step + goal.reaching_m;
  landing_m_ = {step, 2.0 * step, 3.0 * step, 4.0 * step, last, last};
  stand_m_ = last;
  const double front = last + goal.final_distance_m;
  const synthesizer::Drawer& d = robot.drawer;
  target_W_m_[robot::kLeft] << front, d.handle_lateral_m, d.handle_height_m;
  target_W_m_[robot::kRight] << front + goal.object_depth_m - d.pull_m, goal.object_lateral_m,
      d.object_height_m;
  for (const robot::Side s : robot::kSides) {
    left_over_m_[s] = target_W_m_[s] - hand_W_m(s, s == robot::kLeft ? 0.0 : kArrives);
  }
  const robot::Biped& biped = robot.robot->biped;
  aim_.resize(robot.upper.dof());
  for (std::size_t i = 0; i < robot.joint.size(); ++i) {
    aim_[robot.joint[i]] = biped.half_sitting[biped.upper_body[i]];
  }
  q_ = aim_;
  dq_ = aim_rate_ = offset_ = offset_rate_ = Eigen::VectorXd::Zero(aim_.size());
}

/// Where the joints have a hand in action 3, if the pelvis is above the feet.
Eigen::Vector3d Script::hand_W_m(robot::Side side, double phase) {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  X_WB.translation() << stand_m_, 0.0, robot_->pelvis_height_m;
  kinematics_.update(X_WB,
                     at_phase(rows_[synthesizer::kStanding], phase).head(robot_->upper.dof()));
  return kinematics_.X_WL(robot_->upper.require_link(robot_->figure.wrist[side])) *
         robot_->figure.hand_m[side];
}

void Script::find_phase(const walker::PatternSample* plan) {
  const int last = number_;
  if (plan == nullptr || time_s_ < kBegin_s) return;
  steps_ = plan->steps;
  number_ = std::min(steps_ / 2, 3);
  if (number_ == 3) {
    stood_s_ += last == 3 ? kTick_s : 0.0;
    phase_ = std::min(stood_s_ / kStanding_s, 1.0);
  } else {
    const bool begins = plan->gait == walker::Gait::standing;
    const double done = begins ? 0.0 : std::clamp(1.0 - plan->to_landing_s / kStep_s, 0.0, 1.0);
    phase_ = 0.5 * (steps_ % 2 + done);
  }
  if (number_ == last) return;
  if (number_ == 3 && !led_.feet) {
    const double off = 0.5 * (plan->foot[0].X_WS(0, 3) + plan->foot[1].X_WS(0, 3)) - stand_m_;
    stand_m_ += off;
    for (Eigen::Vector3d& target : target_W_m_) target.x() += off;
  }
  const Eigen::Index joints = aim_.size();
  const Eigen::MatrixXd& rows = rows_[action_of(number_)];
  const double duration_s = number_ == 3 ? kStanding_s : 2.0 * kStep_s;
  const double dt_s = duration_s / static_cast<double>(rows.cols());
  offset_ = aim_ - rows.col(0).head(joints);
  offset_rate_ = aim_rate_ - (rows.col(1) - rows.col(0)).head(joints) / dt_s;
  since_s_ = 0.0;
}

/// Moves the joints like BipedDrawerSequence: differences fade, then q̈ = λ²(u − q) − 2λq̇.
void Script::move_upper_body() {
  const Eigen::Index joints = aim_.size();
  const Eigen::VectorXd u_rows = at_phase(rows_[action_of(number_)], phase_).head(joints);
  since_s_ += kTick_s;
  const double decay = std::exp(-kLambda_1_s * kTick_s);
  for (Eigen::Index i = 0; i < joints; ++i) {
    const double u = u_rows[i] + synthesizer::faded(offset_[i], offset_rate_[i], since_s_, kFade_s);
    aim_rate_[i] = (u - aim_[i]) / kTick_s;
    aim_[i] = u;
    const double e = q_[i] - u, a = dq_[i] + kLambda_1_s * e;
    const double next = (e + kTick_s * a) * decay;
    dq_[i] = a * decay - kLambda_1_s * next;
    q_[i] = u + next;
  }
}

void Script::wish_feet(const walker::PatternSample& plan) {
  walker::Wish& w = wish_.walk;
  const auto print = [&](int step) {
    const robot::Side side = step % 2 == 0 ? robot::kRight : robot::kLeft;
    return walker::Footprint{
        side,
        {landing_m_[static_cast<std::size_t>(step)], 0.5 * robot::sign(side) * feet_distance_m_},
        0.0};
  };
  w.landing = {};
  if (!led_.feet) return wish_velocity(plan);
  if (steps_ < 6) w.landing[0] = print(steps_);
  if (steps_ < 6) w.landing[1] = print(steps_ < 5 ? steps_ + 1 : 4);
  w.walk = steps_ < 4;
  w.velocity_m_s.setZero();
  if (steps_ < 6 && plan.gait != walker::Gait::standing) {
    w.velocity_m_s.x() = at_phase(rows_[action_of(number_)], phase_)[aim_.size()];
  }
}

/// The mean that the rows ask for about the next landing. The walk is told to stop when the fifth
/// landing can no longer be changed: the generator closes the feet in the step after it.
void Script::wish_velocity(const walker::PatternSample& plan) {
  walker::Wish& w = wish_.walk;
  const bool stands = plan.gait == walker::Gait::standing;
  w.walk = steps_ < 4 || (steps_ == 4 && plan.to_landing_s > kFrozen_s);
  w.velocity_m_s.setZero();
  w.yaw_rate_rad_s = 0.0;
  if (!w.walk) return;
  // of the samples of the three actions
  const double share = 1.0 / (3.0 * 2.0 * kStep_s), middle_s = (steps_ + 1) * kStep_s;
  const Eigen::Vector3d v = (at_phase(travel_, share * (middle_s + 0.5 * kStep_s)) -
                             at_phase(travel_, share * (middle_s - 0.5 * kStep_s))) /
                            kStep_s;
  w.velocity_m_s = v.head<2>();
  w.yaw_rate_rad_s = v.z();
  if (stands) w.velocity_m_s.y() = -kRightFirst_m_s;
}

void Script::wish_hands() {
  const double share = led_.hands && number_ == 3 ? minimum_jerk(phase_, kGrowFrom, kGrowTo) : 0.0;
  for (const robot::Side s : robot::kSides) {
    wish_.hand[s].share = share;
    if (share <= 0.0) continue;
    const double x = s == robot::kLeft ? share : minimum_jerk(phase_, kGrowTo, kArrives - 0.05);
    wish_.hand[s].p_W_m = hand_W_m(s, std::min(phase_, kArrives)) + x * left_over_m_[s];
  }
}

const walker::WalkerWish& Script::step(const walker::PatternSample* plan) {
  find_phase(plan);
  time_s_ += kTick_s;
  wish_.walk.walk = false;
  if (number_ < 0) return wish_;
  move_upper_body();
  wish_feet(*plan);
  wish_hands();
  wish_.upper_body = q_(robot_->joint);
  wish_.upper_body_rate = dq_(robot_->joint);
  return wish_;
}

namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;
using walker::kTick_s;

/// Mean over one step of two in an action: the pelvis goes faster and slower once a step.
Eigen::RowVectorXd without_sway(const Eigen::RowVectorXd& v) {
  const Index n = v.size(), half = n / 4;
  Eigen::RowVectorXd out(n);
  for (Index k = 0; k < n; ++k) {
    const Index from = std::max<Index>(0, k - half), to = std::min(n, k + half + 1);
    out[k] = v.segment(from, to - from).mean();
  }
  return out;
}

/// Forward velocity of the pelvis; the trials walk straight, and the sway to the sides is the
/// walker's.
MatrixXd velocity(const Recording& r, int number, int samples) {
  const MatrixXd p = resample(r, number, samples, [](const Recording::Tick& t) {
    return VectorXd(t.X_WB.translation().head<2>());
  });
  const double duration_s = number == 3 ? kStanding_s : 2.0 * kStep_s;
  MatrixXd v = MatrixXd::Zero(3, samples);
  for (Index k = 0; k + 1 < samples; ++k) {
    v.col(k).head<2>() = (p.col(k + 1) - p.col(k)) * samples / duration_s;
  }
  v.col(samples - 1) = v.col(samples - 2);
  v.row(1).setZero();
  return v;
}

/// With the travel of the feet.
void give_travel(Eigen::Ref<MatrixXd> v, double length_m) {
  v.row(0) = without_sway(v.row(0));
  v.row(0).array() += length_m / (2.0 * kStep_s) - v.row(0).mean();
}

/// Joints between pelvis and trunk that turn about y.
std::vector<int> waist_pitch(const robot::Biped& biped) {
  std::vector<int> out;
  for (int l = biped.trunk; l > 0; l = biped.tree.link(l).parent) {
    const robot::Link& link = biped.tree.link(l);
    if (link.dof >= 0 && std::abs(link.axis.y()) > 0.9) out.push_back(link.dof);
  }
  return out;
}

/// Set-points as they would be above an upright pelvis: the walker tilts its pelvis to reach, and
/// takes a wished waist as that of an upright one.
VectorXd upright(const Recording::Tick& t, const std::vector<int>& waist) {
  VectorXd q = t.q;
  const double pitch = std::atan2(-t.X_WB(2, 0), t.X_WB(0, 0));
  for (const int dof : waist) q[dof] += pitch / static_cast<double>(waist.size());
  return q;
}

}  // namespace

std::optional<std::size_t> Recording::begin(int number) const {
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    if (ticks[i].number == number) return i;
  }
  return {};
}

Recording record(const ScriptRobot& robot, Script script) {
  const robot::Biped& biped = robot.robot->biped;
  walker::WalkerSettings settings;
  settings.stabilize = false;
  walker::Walker walker(biped, settings);
  walker::Sensors sensors;
  sensors.q = biped.half_sitting;
  sensors.dq = VectorXd::Zero(biped.tree.dof());
  Recording out;
  const walker::PatternSample* plan = nullptr;
  const auto ticks = static_cast<int>(std::lround(kScript_s / kTick_s));
  for (int k = 0; k < ticks; ++k) {
    const walker::WalkerOutput& now = walker.step(script.step(plan), sensors);
    plan = &now.pattern;
    out.ticks.push_back({script.number(), script.phase(), now.q, now.X_WB, now.pattern});
    out.clipped += now.clipped;
    out.failed += now.failed;
    out.limited += now.limited;
    if (out.trouble.empty()) out.trouble = now.trouble;
  }
  return out;
}

FeasibleData make_feasible(const ScriptRobot& robot, const synthesizer::DrawerData& data, Led led) {
  const std::size_t trials = data.action[0].trials.size();
  FeasibleData out{data, data, {}};
  out.recordings = in_parallel(trials, [&](std::size_t i) {
    return record(robot, Script(robot, rows_of(data, i), goal_of(data, i), led));
  });
  const auto joints = static_cast<Index>(robot.robot->biped.tree.dof());
  const auto upper = static_cast<Index>(robot.upper.dof());
  std::vector<Index> of_tree(static_cast<std::size_t>(upper));
  for (std::size_t i = 0; i < robot.joint.size(); ++i) {
    of_tree[static_cast<std::size_t>(robot.joint[i])] = robot.robot->biped.upper_body[i];
  }
  const std::vector<int> waist = waist_pitch(robot.robot->biped);
  for (std::size_t a = 0; a < data.action.size(); ++a) {
    const Index samples = data.action[a].samples.cols();
    const auto n = static_cast<int>(samples);
    mocap::Trials &u = out.upper_body.action[a], &q = out.joints.action[a];
    q.rows = robot.robot->biped.tree.joint_names();
    q.samples.resize(static_cast<Index>(trials) * joints, samples);
    const int number = static_cast<int>(a) + 1;
    for (std::size_t i = 0; i < trials; ++i) {
      const Recording& r = out.recordings[i];
      if (!r.begin(3))
        throw ConfigError("trial " + std::to_string(i) + " of the drawer: " +
                          (r.trouble.empty() ? "the walk does not end" : r.trouble));
      const MatrixXd all = resample(r, number, n, [](const Recording::Tick& t) { return t.q; });
      q.samples.middleRows(static_cast<Index>(i) * joints, joints) = all;
      auto block = u.samples.middleRows(static_cast<Index>(i) * (upper + 3), upper + 3);
      const MatrixXd above =
          resample(r, number, n, [&](const Recording::Tick& t) { return upright(t, waist); });
      block.topRows(upper) = above(of_tree, Eigen::all);
      block.bottomRows(3) = velocity(r, number, n);
      if (led.feet) give_travel(block.bottomRows(3), data.action[a].trials[i].step_length_m);
    }
  }
  return out;
}

}  // namespace mimesis::walk
