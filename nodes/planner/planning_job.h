#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "common/runtime/job.h"
#include "nodes/planner/move_plan.h"

namespace mimesis::planner {

/// One plan at a time, computed beside the steps, with a deadline; cancelled when nobody waits for
/// it any more. A deadline is one of the wall clock: what is recorded is the question at which the
/// computation was interrupted, so that a replay ends there. In lock-step time stands still, and
/// deadlines do not pass.
class PlanningJob {
 public:
  struct Done {
    std::shared_ptr<const Roadmap> roadmap;  ///< null: it was interrupted before
    tl::expected<TaskPlan, Status> plan;
    double compute_s = 0.0;  ///< wall time
  };

  PlanningJob(runtime::Bus& bus, kin::ArmModel arm, TaskSettings settings);

  /// Precondition: not running. Refreshes the roadmap `known`, or prepares one if it is null.
  /// @param deadline_s  after the begin of the computation; 0: none
  void start(PlanRequest request, std::shared_ptr<const Roadmap> known, double deadline_s = 0.0);
  /// The work ends soon. `take` then gives neither roadmap nor plan; in lock-step, where the work
  /// has ended already, both.
  void cancel() { *cancelled_ = true; }
  bool running() const { return job_.running(); }
  std::optional<Done> take();

 private:
  struct Work {
    Done done;
    std::uint64_t told_at;  // see Interrupt
  };

  runtime::Bus& bus_;
  kin::ArmModel arm_;
  TaskSettings settings_;
  std::shared_ptr<std::atomic<bool>> cancelled_ = std::make_shared<std::atomic<bool>>(false);
  bool timed_ = false;
  runtime::Job<Work> job_;
};

}  // namespace mimesis::planner
