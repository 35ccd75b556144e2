#pragma once
#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/job.h"
#include "common/runtime/ports.h"
#include "nodes/planner/move_plan.h"
#include "nodes/planner/task_sequence.h"
#include "proto/cognition.pb.h"
#include "proto/planner.pb.h"

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

/// Part of the `Order::id` of a request, beside its ticket.
inline constexpr std::uint64_t kOfTicket = std::uint64_t{1} << 63;

/// Requests of any number of clients. Services:
///   plan, test  a plan without a motion, with all its motions or whether there is one
///   do, home    the arm does it, one request after the other
///   abort       ends a request, or all (ticket 0)
///   answer      the answer to a ticket, once it exists
/// A request is taken between two steps, checked, and waits for its turn; the answer is published
/// on port `answer`. Port `proposal` asks for a test, too, which port `trial` answers [M18
/// fig. 2.22].
class Requests {
 public:
  enum class Kind : std::uint8_t { plan, test, execute };
  /// What a service ended besides what is kept here: the order at work, all orders.
  enum class Abort : std::uint8_t { nothing, order, all };

  /// @param ready_s  longest wait of a test for scene and arm [s]
  Requests(runtime::Bus& bus, const kin::ArmModel& arm, const TaskSettings& settings,
           double ready_s);

  /// Begins and ends tests and plans; these use `roadmap`, and leave theirs there.
  /// @param table, arm  null: not known
  void step(runtime::Time now, const kin::Table* table, const ArmReading* arm,
            std::shared_ptr<const Roadmap>& roadmap);
  /// The order whose turn it is; null: none.
  const Order* next() const { return orders_.empty() ? nullptr : &orders_.front().order; }
  double deadline_s(std::uint64_t order_id) const;
  /// After the sequence's step: answers what it has done, and publishes all answers.
  void follow(runtime::Time now, const TaskSequence& sequence, double compute_s);
  Abort take_abort() { return std::exchange(abort_, Abort::nothing); }

 private:
  struct Waiting {
    std::uint64_t ticket = 0;
    Kind kind = Kind::execute;
    Order order;
    std::string client;
    std::optional<Eigen::VectorXd> start{};
    double deadline_s = 0.0;
    std::optional<v1::Decision> proposal{};  // instead of a client
    std::optional<runtime::Time> since{};    // waits for scene or arm
  };

  void serve(runtime::Bus& bus);
  tl::expected<v1::PlanTicket, Status> add(Kind kind, const v1::PlanRequest& asked);
  tl::expected<v1::PlanAnswer, Status> answer_to(std::uint64_t ticket) const;
  std::string end(std::uint64_t ticket);
  void hear_proposal();
  void start_next(runtime::Time now, const kin::Table* table, const ArmReading* arm,
                  const std::shared_ptr<const Roadmap>& roadmap);
  void answer(const Waiting& request, const tl::expected<TaskPlan, Status>& plan,
              double compute_s = 0.0);

  const kin::ArmModel& arm_;
  double ready_s_;
  PlanningJob job_;
  std::optional<Waiting> tested_;  // by the job
  bool useless_ = false;           // nobody waits for it
  std::deque<Waiting> tests_, orders_;
  std::uint64_t tickets_ = 0, proposed_ = 0;
  Abort abort_ = Abort::nothing;
  bool begun_ = false;  // the first of orders_
  std::deque<v1::PlanAnswer> answers_;
  std::vector<v1::TaskStatus> trials_;
  std::size_t unpublished_ = 0;  // the last of answers_

  runtime::Latest<v1::Decision> proposal_in_;
  runtime::Out<v1::TaskStatus> trial_;
  runtime::Out<v1::PlanAnswer> answer_;
};

}  // namespace mimesis::planner
