#pragma once
#include <vector>

#include "nodes/walker/tasks/stack.h"

namespace mimesis::walker {

/// A task of the stack with the robot's numbers instead of names.
struct Task {
  TaskKind kind = TaskKind::kPosture;
  int level = 0;  ///< 0 comes first; no gaps
  double weight = 1.0, gain_1_s = 20.0;
  int link = -1;
  int side = 0;                 ///< foot or hand
  std::vector<int> dofs = {};   ///< kPosture: joints
  std::vector<int> upper = {};  ///< of them: index in Biped::upper_body, or −1
  std::vector<int> axes = {};   ///< of 3, kFoot of 6, that count
};

/// Tasks in the order of their priorities.
/// @throws ConfigError "stack.tasks: 'NAME': what, expected ..."
std::vector<Task> make_tasks(const robot::Biped& biped, const StackSettings& settings);

}  // namespace mimesis::walker
