#pragma once
#include "common/model/files.h"
#include "nodes/planner/task_plan.h"

namespace mimesis::planner {

/// Arm, table and roadmap of the demo.
struct Demo {
  kin::ArmModel arm = model::load_arm("lwr4.yaml");
  kin::Table table = model::load_table("bar_table.yaml");
  TaskSettings settings;
  Roadmap roadmap = prepare_roadmap(arm, table, settings);

  tl::expected<TaskPlan, Status> plan(const Task& task, const Interrupt& interrupt = {}) const {
    TaskSettings with = settings;
    with.interrupt = interrupt;
    return plan_task(arm, table, roadmap, arm.home, task, with);
  }
};

inline const Demo& demo() {
  static const Demo one;
  return one;
}

}  // namespace mimesis::planner
