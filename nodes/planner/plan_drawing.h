#pragma once
#include <chrono>

#include "nodes/planner/task_plan.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/scene.pb.h"

namespace mimesis::planner {

/// The way of the hand in all motions of a plan, in W: blue empty, violet holding, with the hand's
/// axes at grasp and release. One entity, "plan".
foxglove::SceneUpdate draw_plan(const kin::ArmModel& arm, const TaskPlan& plan,
                                std::chrono::nanoseconds stamp);

/// What planning knows of the table, in W: object, goals and bar where they were seen, each with an
/// ellipsoid of three standard deviations and the largest of them in words. One entity, "seen".
foxglove::SceneUpdate draw_seen(const v1::Scene& scene, std::chrono::nanoseconds stamp);

}  // namespace mimesis::planner
