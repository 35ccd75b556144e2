#include "nodes/walker/tasks/task_rows.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/error.h"
#include "common/math/so3.h"

namespace mimesis::walker {
namespace {

[[noreturn]] void refuse(const TaskSpec& spec, const std::string& what) {
  throw ConfigError("stack.tasks: '" + spec.name + "': " + what);
}

bool has_link(TaskKind kind) {
  return kind == TaskKind::foot || kind == TaskKind::orientation || kind == TaskKind::position;
}

/// @return the side whose link this is. @throws ConfigError if it is neither.
int side_of(const TaskSpec& spec, int link, const std::array<int, 2>& links, const char* what) {
  for (int side = 0; side < 2; ++side) {
    if (links[static_cast<std::size_t>(side)] == link) return side;
  }
  refuse(spec, "link '" + spec.link + "' is no " + what + " of the robot");
}

void take_link(const robot::Biped& biped, const TaskSpec& spec, Task& task) {
  if (!has_link(spec.kind)) {
    if (!spec.link.empty()) refuse(spec, "link '" + spec.link + "', expected none for its kind");
    return;
  }
  task.link = biped.tree.find_link(spec.link);
  if (task.link < 0) {
    refuse(spec, "robot " + biped.tree.name() + " has no link '" + spec.link + "'");
  }
  if (spec.kind == TaskKind::foot) {
    task.side = side_of(spec, task.link, {biped.leg[0].sole, biped.leg[1].sole}, "sole");
  }
  if (spec.kind == TaskKind::position) task.side = side_of(spec, task.link, biped.hand, "hand");
}

void take_joints(const robot::Biped& biped, const TaskSpec& spec, Task& task) {
  if (spec.kind != TaskKind::posture) {
    if (!spec.joints.empty()) refuse(spec, "joints, expected none for its kind");
    return;
  }
  if (spec.joints.empty()) task.dofs = biped.upper_body;
  for (const std::string& joint : spec.joints) {
    const int dof = biped.tree.find_joint(joint);
    if (dof < 0) refuse(spec, "robot " + biped.tree.name() + " has no joint '" + joint + "'");
    if (std::ranges::find(task.dofs, dof) != task.dofs.end()) {
      refuse(spec, "joint '" + joint + "' twice");
    }
    task.dofs.push_back(dof);
  }
  for (const int dof : task.dofs) {
    const auto at = std::ranges::find(biped.upper_body, dof);
    task.upper.push_back(
        at == biped.upper_body.end() ? -1 : static_cast<int>(at - biped.upper_body.begin()));
  }
}

void take_axes(const TaskSpec& spec, Task& task) {
  const bool foot = spec.kind == TaskKind::foot;
  const bool has_axes = has_link(spec.kind) || spec.kind == TaskKind::com;
  const std::size_t n = spec.axes.size();
  if (!has_axes && n > 0) refuse(spec, "axes, expected none for its kind");
  if (n != 0 && n != 3 && !(foot && n == 6)) {
    refuse(spec, "axes: " + std::to_string(n) + " of them, expected 3" + (foot ? " or 6" : ""));
  }
  for (int i = 0; i < (foot ? 6 : 3); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (has_axes && (k >= n || spec.axes[k])) task.axes.push_back(i);
  }
  if (has_axes && task.axes.empty()) refuse(spec, "axes: none counts, expected at least one");
}

using Eigen::Matrix3d, Eigen::Vector3d;

// Longest steps within a tick for which the Jacobian is valid.
constexpr double kFarthest_m = 0.02, kFarthest_rad = 0.2;
// At most a tenth of an error beyond this is removed per tick, for any gain.
constexpr double kAtOnce_m = 0.004, kAtOnce_rad = 0.02, kLeastShare = 0.1;
// A goal that moves faster has jumped; its rate is ignored.
constexpr double kJump_m_s = 3.0, kJump_rad_s = 8.0;
// A missing height returns by this share per tick.
constexpr double kReturn = 0.25, kHeightIsBack_m = 1e-6;
// Factor on the weight of a hand with share 1, against the posture of its level.
constexpr double kWhole = 1e6;

/// Step of a task within a tick: the goal's own movement plus a share of the error.
Vector3d step_of(const Task& task, const Vector3d& way, const Vector3d& rate, double dt_s,
                 double at_once) {
  const Vector3d lag = way - dt_s * rate;
  const double most = std::max(kLeastShare, at_once / std::max(at_once, lag.norm()));
  return dt_s * rate + std::min({1.0, task.gain_1_s * dt_s, most}) * lag;
}

/// Factor on a hand's weight: about its share at first, far above the posture at share 1. The
/// posture's weights stay constant: if they were lowered for one hand, the other one would move the
/// joints that both share as soon as its own share is above 0.
double strength(double share) {
  const double left = 1.0 - share;
  return share / (left * left + 1.0 / kWhole);
}

Vector3d shorter(const Vector3d& v, double most) {
  const double length = v.norm();
  return length > most ? Vector3d(v * (most / length)) : v;
}

}  // namespace

std::vector<Task> make_tasks(const robot::Biped& biped, const StackSettings& settings) {
  if (settings.tasks.empty()) throw ConfigError("stack.tasks: none, expected at least one");
  std::set<std::string> names;
  std::set<int> priorities;
  for (const TaskSpec& spec : settings.tasks) {
    if (spec.name.empty()) throw ConfigError("stack.tasks: a task without a name");
    if (!names.insert(spec.name).second) refuse(spec, "name twice");
    priorities.insert(spec.priority);
  }
  std::vector<Task> tasks;
  for (const TaskSpec& spec : settings.tasks) {
    Task task{.kind = spec.kind,
              .level = static_cast<int>(
                  std::distance(priorities.begin(), priorities.find(spec.priority))),
              .weight = spec.weight,
              .gain_1_s = spec.gain_1_s};
    take_link(biped, spec, task);
    take_joints(biped, spec, task);
    take_axes(spec, task);
    tasks.push_back(std::move(task));
  }
  std::ranges::stable_sort(tasks, {}, &Task::level);
  return tasks;
}

StackSettings walking_stack(const robot::Biped& biped) {
  const auto link = [&](int index) { return biped.tree.link(index).name; };
  StackSettings settings;
  auto& tasks = settings.tasks;
  // Weights: when a leg is too short the height gives way first, then the rest of the CoM.
  constexpr double kAtOnce_1_s = 200.0;
  for (const Side side : robot::kSides) {
    const std::string name = side == kLeft ? "left" : "right";
    tasks.push_back({.name = name + " foot",
                     .kind = TaskKind::foot,
                     .priority = 1,
                     .weight = 100.0,
                     .gain_1_s = kAtOnce_1_s,
                     .link = link(biped.leg[static_cast<std::size_t>(side)].sole)});
  }
  tasks.push_back({.name = "com",
                   .kind = TaskKind::com,
                   .priority = 1,
                   .weight = 10.0,
                   .gain_1_s = kAtOnce_1_s,
                   .axes = {true, true, false}});
  tasks.push_back({.name = "com height",
                   .kind = TaskKind::com,
                   .priority = 1,
                   .gain_1_s = kAtOnce_1_s,
                   .axes = {false, false, true}});
  tasks.push_back({.name = "trunk",
                   .kind = TaskKind::orientation,
                   .priority = 2,
                   .gain_1_s = 50.0,
                   .link = link(biped.trunk)});
  for (const Side side : robot::kSides) {
    const int hand = biped.hand[static_cast<std::size_t>(side)];
    if (hand < 0) continue;
    tasks.push_back({.name = side == kLeft ? "left hand" : "right hand",
                     .kind = TaskKind::position,
                     .priority = 3,
                     .weight = 10.0,
                     .gain_1_s = 50.0,
                     .link = link(hand)});
  }
  tasks.push_back({.name = "upper body", .kind = TaskKind::posture, .priority = 3});
  tasks.push_back({.name = "rest", .kind = TaskKind::regularisation, .priority = 4});
  return settings;
}

TaskRows::TaskRows(const robot::Biped& biped, std::vector<Task> tasks)
    : biped_(&biped),
      leg_room_(biped),
      tasks_(std::move(tasks)),
      aims_(tasks_.size()),
      joint_goal_(static_cast<std::size_t>(biped.tree.dof())),
      R_before_(Matrix3d::Identity()),
      jacobian_(6, 6 + biped.tree.dof()),
      com_jacobian_(3, 6 + biped.tree.dof()) {
  for (const Task& task : tasks_) {
    levels_ = std::max(levels_, task.level + 1);
    most_rows_ += task.kind == TaskKind::regularisation
                      ? 6 + biped.tree.dof()
                      : static_cast<int>(task.axes.size() + task.dofs.size());
  }
  const auto last = std::ranges::count(tasks_, levels_ - 1, &Task::level);
  rest_is_last_ = last == 1 && tasks_.back().kind == TaskKind::regularisation;
}

void TaskRows::forget() {
  has_before_ = height_returns_ = false;
  leg_room_.reset();
}

void TaskRows::aim(const Posture& posture, const TaskGoals& goals, double dt_s,
                   const Eigen::Ref<const Eigen::VectorXd>& lower,
                   const Eigen::Ref<const Eigen::VectorXd>& upper) {
  const Vector3d turn = has_before_ ? math::log_so3(goals.R_W_trunk * R_before_.transpose()) / dt_s
                                    : Vector3d(Vector3d::Zero());
  const Vector3d trunk_rate = turn.norm() > kJump_rad_s ? Vector3d(Vector3d::Zero()) : turn;
  for (std::size_t i = 0; i < tasks_.size(); ++i) {
    const Task& task = tasks_[i];
    Aim& aim = aims_[i];
    switch (task.kind) {
      case TaskKind::com:
        aim_at_com(task, aim, posture, goals, dt_s, lower, upper);
        break;
      case TaskKind::foot:
        aim_at_foot(task, aim, posture, goals, dt_s);
        break;
      case TaskKind::orientation:
        aim_at_rotation(task, aim, posture.kinematics.X_WL(task.link).linear(), goals.R_W_trunk,
                        trunk_rate, dt_s);
        break;
      case TaskKind::position:
        aim_at_hand(task, aim, posture, goals, dt_s);
        break;
      case TaskKind::posture:
        aim_at_posture(task, posture, goals, dt_s);
        break;
      case TaskKind::regularisation:
        break;
    }
  }
  R_before_ = goals.R_W_trunk;
  has_before_ = true;
}

/// Does not ask the rest of the body for height that the legs cannot give.
void TaskRows::aim_at_com(const Task& task, Aim& aim, const Posture& posture,
                          const TaskGoals& goals, double dt_s,
                          const Eigen::Ref<const Eigen::VectorXd>& lower,
                          const Eigen::Ref<const Eigen::VectorXd>& upper) {
  aim_at_position(task, aim, posture.com_W, goals.com_W_m, goals.com_v_W, dt_s);
  if (std::ranges::find(task.axes, 2) == task.axes.end()) return;
  Vector3d way = aim.p_W - posture.com_W;
  // A missing height returns in decreasing steps, not at once.
  const double along = dt_s * goals.com_v_W.z(),
               lag = goals.com_W_m.z() - posture.com_W.z() - along;
  height_returns_ = leg_room_.missing_m() > kHeightIsBack_m ||
                    (height_returns_ && std::abs(lag) > kHeightIsBack_m);
  if (height_returns_) {
    const double most = kReturn * std::abs(lag);
    way.z() = std::clamp(way.z(), along - most, along + most);
  }
  std::array<Vector3d, 2> feet;
  for (const Side side : robot::kSides) {
    const auto& X_WS = posture.kinematics.X_WL(biped_->leg[side].sole);
    feet[side] = shorter(goals.foot[side].X_WS.translation() - X_WS.translation(), kFarthest_m);
  }
  const double rise = leg_room_.rise_m({.kinematics = posture.kinematics,
                                        .q = posture.q,
                                        .lower = lower,
                                        .upper = upper,
                                        .com_W_m = posture.com_W,
                                        .com_way_m = way,
                                        .feet_way_m = feet,
                                        .dt_s = dt_s});
  if (rise == aim.p_W.z() - posture.com_W.z()) return;
  aim.p_W.z() = posture.com_W.z() + std::clamp(rise, -kFarthest_m, kFarthest_m);
}

void TaskRows::aim_at_foot(const Task& task, Aim& aim, const Posture& posture,
                           const TaskGoals& goals, double dt_s) const {
  const FootState& foot = goals.foot[static_cast<std::size_t>(task.side)];
  const Eigen::Isometry3d& X = posture.kinematics.X_WL(task.link);
  aim_at_position(task, aim, X.translation(), foot.X_WS.translation(), foot.v_W, dt_s);
  aim_at_rotation(task, aim, X.linear(), foot.X_WS.linear(),
                  foot.yaw_rate_rad_s * Vector3d::UnitZ(), dt_s);
}

void TaskRows::aim_at_hand(const Task& task, Aim& aim, const Posture& posture,
                           const TaskGoals& goals, double dt_s) const {
  const TaskGoals::Hand& hand = goals.hand[static_cast<std::size_t>(task.side)];
  aim.strength = strength(std::clamp(hand.share, 0.0, 1.0));
  aim.used = aim.strength > 0.0;
  const Vector3d moved = (hand.p_W_m - aim.before_p_W) / dt_s;
  const bool follows = has_before_ && moved.norm() < kJump_m_s;
  aim_at_position(task, aim, posture.kinematics.X_WL(task.link).translation(), hand.p_W_m,
                  follows ? moved : Vector3d(Vector3d::Zero()), dt_s);
  aim.before_p_W = hand.p_W_m;
}

/// The rate is the goal's at the end of the tick, the error that at its beginning, so that
/// v = rate + gain·(goal − now) arrives at once if gain·dt is 1.
void TaskRows::aim_at_position(const Task& task, Aim& aim, const Vector3d& now,
                               const Vector3d& goal, const Vector3d& rate, double dt_s) const {
  const Vector3d step = step_of(task, goal - now, rate, dt_s, kAtOnce_m);
  aim.p_W = now + shorter(step, kFarthest_m);
}

void TaskRows::aim_at_rotation(const Task& task, Aim& aim, const Matrix3d& now,
                               const Matrix3d& goal, const Vector3d& rate, double dt_s) const {
  const Vector3d way = math::log_so3(goal * now.transpose());
  const Vector3d step = step_of(task, way, rate, dt_s, kAtOnce_rad);
  aim.R_W = math::exp_so3(shorter(step, kFarthest_rad)) * now;
}

void TaskRows::aim_at_posture(const Task& task, const Posture& posture, const TaskGoals& goals,
                              double dt_s) {
  const double share = std::min(1.0, task.gain_1_s * dt_s);
  for (std::size_t k = 0; k < task.dofs.size(); ++k) {
    const int dof = task.dofs[k], upper = task.upper[k];
    const double now = posture.q[dof];
    const double goal = upper < 0 ? biped_->half_sitting[dof] : goals.upper_body[upper];
    const double rate =
        upper < 0 || goals.upper_body_rate.size() == 0 ? 0.0 : goals.upper_body_rate[upper];
    const double step = (1.0 - share) * dt_s * rate + share * (goal - now);
    joint_goal_[static_cast<std::size_t>(dof)] =
        now + std::clamp(step, -kFarthest_rad, kFarthest_rad);
  }
}

void TaskRows::fill(const Posture& posture, Cascade& cascade) {
  cascade.clear();
  posture.dynamics.com_jacobian(posture.kinematics, com_jacobian_);
  used_ = 0;
  for (int level = 0, i = 0; level < levels_; ++level) {
    if (cascade.free() == 0 || (rest_is_last_ && level == levels_ - 1)) break;
    cascade.begin_level();
    for (; i < static_cast<int>(tasks_.size()); ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (tasks_[at].level != level) break;
      if (aims_[at].used) fill_task(tasks_[at], aims_[at], posture, cascade);
    }
    if (level == 0) first_level_rows_ = cascade.rows();
    used_ = i;
  }
}

void TaskRows::fill_task(const Task& task, const Aim& aim, const Posture& posture,
                         Cascade& cascade) {
  switch (task.kind) {
    case TaskKind::com:
      for (const int axis : task.axes) cascade.add_row(com_jacobian_.row(axis), task.weight);
      break;
    case TaskKind::foot:
    case TaskKind::orientation:
    case TaskKind::position: {
      posture.kinematics.jacobian(task.link, posture.kinematics.X_WL(task.link).translation(),
                                  jacobian_);
      const int from = task.kind == TaskKind::orientation ? 3 : 0;
      for (const int axis : task.axes) {
        cascade.add_row(jacobian_.row(from + axis), task.weight * aim.strength);
      }
      break;
    }
    case TaskKind::posture:
      for (const int dof : task.dofs) cascade.add_axis(6 + dof, task.weight);
      break;
    case TaskKind::regularisation:
      for (int i = 0; i < 6 + biped_->tree.dof(); ++i) cascade.add_axis(i, task.weight);
      break;
  }
}

void TaskRows::missing(const Posture& posture, Eigen::Ref<Eigen::VectorXd> b) const {
  Eigen::Index row = 0;
  for (int i = 0; i < used_; ++i) {
    const Task& task = tasks_[static_cast<std::size_t>(i)];
    const Aim& aim = aims_[static_cast<std::size_t>(i)];
    if (!aim.used) continue;
    Eigen::Matrix<double, 6, 1> error = Eigen::Matrix<double, 6, 1>::Zero();
    switch (task.kind) {
      case TaskKind::com:
        error.head<3>() = aim.p_W - posture.com_W;
        break;
      case TaskKind::foot:
        error.tail<3>() =
            math::log_so3(aim.R_W * posture.kinematics.X_WL(task.link).linear().transpose());
        [[fallthrough]];
      case TaskKind::position:
        error.head<3>() = aim.p_W - posture.kinematics.X_WL(task.link).translation();
        break;
      case TaskKind::orientation:
        error.head<3>() =
            math::log_so3(aim.R_W * posture.kinematics.X_WL(task.link).linear().transpose());
        break;
      case TaskKind::posture:
        for (const int dof : task.dofs) {
          b[row++] = joint_goal_[static_cast<std::size_t>(dof)] - posture.q[dof];
        }
        break;
      case TaskKind::regularisation:
        for (int k = 0; k < 6 + biped_->tree.dof(); ++k) b[row++] = 0.0;
        break;
    }
    for (const int axis : task.axes) b[row++] = error[axis];
  }
}

}  // namespace mimesis::walker
