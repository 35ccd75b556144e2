#pragma once
#include <string>

#include "hw/sim/world/object.h"

namespace mimesis::world {

/// How the planner says it ended.
struct TaskEnd {
  bool done = false;   ///< false: failed
  std::string goal;    ///< "high", "low", or empty if none was decided
  std::string reason;  ///< of a failure
};

struct Verdict {
  bool placed = false;  ///< at rest, upright and released within the goal's radius, after a grasp
  double placement_error =
      -1.0;            ///< distance of the object's centre from the goal [m], -1 without goal
  std::string reason;  ///< what went wrong; empty if nothing did
};

/// Judges by what happened to the object, not by what the planner says; the planner's reason
/// explains a failure. Precondition: the object does not fall.
Verdict judge(const TaskEnd& end, const ObjectModel& object,
              const std::vector<kin::GoalPlace>& goals);

}  // namespace mimesis::world
