#include "nodes/walker/tasks/task_list.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/error.h"

namespace mimesis::walker {
namespace {

[[noreturn]] void refuse(const TaskSpec& spec, const std::string& what) {
  throw ConfigError("stack.tasks: '" + spec.name + "': " + what);
}

void check_numbers(const TaskSpec& spec) {
  if (spec.priority < 1) {
    refuse(spec, "priority " + std::to_string(spec.priority) + ", expected 1 or more");
  }
  if (!(spec.weight > 0.0 && spec.weight <= 1e6)) {
    refuse(spec, "weight " + std::to_string(spec.weight) + ", expected above 0, at most 1e6");
  }
  if (!(spec.gain_1_s > 0.0 && spec.gain_1_s <= 1e4)) {
    refuse(spec, "gain_1_s " + std::to_string(spec.gain_1_s) + ", expected above 0, at most 1e4");
  }
}

bool has_link(TaskKind kind) {
  return kind == TaskKind::kFoot || kind == TaskKind::kOrientation || kind == TaskKind::kPosition;
}

/// Which of two links it is. @throws ConfigError if it is neither.
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
  if (spec.kind == TaskKind::kFoot) {
    task.side = side_of(spec, task.link, {biped.leg[0].sole, biped.leg[1].sole}, "sole");
  }
  if (spec.kind == TaskKind::kPosition) task.side = side_of(spec, task.link, biped.hand, "hand");
}

void take_joints(const robot::Biped& biped, const TaskSpec& spec, Task& task) {
  if (spec.kind != TaskKind::kPosture) {
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
  const bool foot = spec.kind == TaskKind::kFoot;
  const bool has_axes = has_link(spec.kind) || spec.kind == TaskKind::kCom;
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

}  // namespace

std::vector<Task> make_tasks(const robot::Biped& biped, const StackSettings& settings) {
  if (settings.tasks.empty()) throw ConfigError("stack.tasks: none, expected at least one");
  std::set<std::string> names;
  std::set<int> priorities;
  for (const TaskSpec& spec : settings.tasks) {
    if (spec.name.empty()) throw ConfigError("stack.tasks: a task without a name");
    if (!names.insert(spec.name).second) refuse(spec, "name twice");
    check_numbers(spec);
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
  // What gives way first when a leg is too short: the height, then the rest of the CoM.
  constexpr double kAtOnce_1_s = 200.0;
  for (const Side side : robot::kSides) {
    const std::string name = side == kLeft ? "left" : "right";
    tasks.push_back({.name = name + " foot",
                     .kind = TaskKind::kFoot,
                     .priority = 1,
                     .weight = 100.0,
                     .gain_1_s = kAtOnce_1_s,
                     .link = link(biped.leg[static_cast<std::size_t>(side)].sole)});
  }
  tasks.push_back({.name = "com",
                   .kind = TaskKind::kCom,
                   .priority = 1,
                   .weight = 10.0,
                   .gain_1_s = kAtOnce_1_s,
                   .axes = {true, true, false}});
  tasks.push_back({.name = "com height",
                   .kind = TaskKind::kCom,
                   .priority = 1,
                   .gain_1_s = kAtOnce_1_s,
                   .axes = {false, false, true}});
  tasks.push_back({.name = "trunk",
                   .kind = TaskKind::kOrientation,
                   .priority = 2,
                   .gain_1_s = 50.0,
                   .link = link(biped.trunk)});
  for (const Side side : robot::kSides) {
    const int hand = biped.hand[static_cast<std::size_t>(side)];
    if (hand < 0) continue;
    tasks.push_back({.name = side == kLeft ? "left hand" : "right hand",
                     .kind = TaskKind::kPosition,
                     .priority = 3,
                     .weight = 10.0,
                     .gain_1_s = 50.0,
                     .link = link(hand)});
  }
  tasks.push_back({.name = "upper body", .kind = TaskKind::kPosture, .priority = 3});
  tasks.push_back({.name = "rest", .kind = TaskKind::kRegularisation, .priority = 4});
  return settings;
}

}  // namespace mimesis::walker
