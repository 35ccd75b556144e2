#include "hw/sim/world/verdict.h"

#include <algorithm>

#include "common/error.h"
#include "hw/sim/world/text.h"

namespace mimesis::world {
namespace {

/// Why the object is not where it should be, as the world saw it.
std::string observed(const ObjectModel& object, const kin::GoalPlace* goal, double error) {
  if (!object.mishap().empty()) return "object " + object.mishap();
  if (!object.was_held()) return "object not grasped";
  if (object.state() == ObjectState::held) return "object not released";
  if (goal == nullptr) return "no goal was decided";
  return "placed " + millimetres(error) + " from goal " + goal->name + " (radius " +
         millimetres(goal->radius) + ")";
}

}  // namespace

Verdict judge(const TaskEnd& end, const ObjectModel& object,
              const std::vector<kin::GoalPlace>& goals) {
  MIMESIS_ASSERT(object.state() != ObjectState::falling);
  const auto goal = std::find_if(goals.begin(), goals.end(),
                                 [&](const kin::GoalPlace& g) { return g.name == end.goal; });
  Verdict verdict;
  if (goal != goals.end()) {
    verdict.placement_error = (object.cylinder().X_WO.translation() - goal->position).norm();
    verdict.placed = object.was_held() && object.state() == ObjectState::resting &&
                     object.upright() && verdict.placement_error <= goal->radius;
  }
  if (!end.done) {
    verdict.reason = end.reason.empty() ? "the planner failed without a reason" : end.reason;
  } else if (!verdict.placed) {
    verdict.reason =
        observed(object, goal == goals.end() ? nullptr : &*goal, verdict.placement_error);
  }
  return verdict;
}

}  // namespace mimesis::world
