#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <tl/expected.hpp>

#include "nodes/planner/move_plan.h"
#include "nodes/planner/time_scaling.h"

namespace mimesis::planner {

struct SequenceSettings {
  double period_s = 0.005;  ///< period of step() and of the trajectories [s]
  double ready_s = 10.0;    ///< scene, arm and hand must be there, the arm operational, by then [s]
  double hand_s = 5.0;      ///< the hand must have opened or closed by then [s]
  double settle_s = 2.0;    ///< the arm must have arrived this long after a motion's end [s]
  double planning_s = 20.0;    ///< a plan must have come by then [s]
  double arrival_rad = 0.01;   ///< it has arrived within this [rad]
  double tracking_rad = 0.25;  ///< largest allowed difference of set-point and posture [rad]
  double object_moved_m =
      0.005;  ///< the object moved if farther than this from where it was planned for [m]
  bool has_hand = true;          ///< false: it moves, and takes nothing
  double open_closure = 0.05;    ///< the hand is open below this [1]
  double grip_force = 0.5;       ///< commanded force, 0 .. 1 [1]
  double resume_s = 2.0;         ///< a motion that waits for what it depends on goes on within [s]
  Eigen::Index ahead = 60;       ///< periods of `SetPoint::ahead` [1]
  Eigen::VectorXd a_max_rad_s2;  ///< accelerations that braking on the path may use, n [rad/s²]
  /// Tells whether the plan's motions from the `first` on keep clear of what moved on the table
  /// since it was planned. Empty: the table is taken to stand still.
  std::function<bool(const TaskPlan&, std::size_t first, const kin::Table& planned,
                     const kin::Table& now)>
      keeps_clear{};
};

/// A settled decision or a client's request; `id` changes with every new one.
struct Order {
  std::variant<Task, Move> what;
  std::uint64_t id = 0;
};

struct ArmReading {
  Eigen::VectorXd q;         ///< [rad]
  bool operational = false;  ///< all drives follow
  std::string fault;         ///< empty if none
};

struct HandReading {
  double closure = 0.0;  ///< 0 open .. 1 closed [1]
  bool moving = false;
  bool object_detected = false;
  bool active = false;
  std::string fault;
};

/// Inputs of one step. Null: unknown or stale.
struct SequenceInput {
  const Order* order = nullptr;
  const kin::Table* table = nullptr;
  const ArmReading* arm = nullptr;
  const HandReading* hand = nullptr;
  /// Input that the motion depends on and that is silent ("the scene"); empty: none is.
  std::string missing{};
  int periods = 1;     ///< since the last step; more if steps were left out
  bool abort = false;  ///< the order at work ends: the arm brakes on its path
};

struct SetPoint {
  Eigen::VectorXd q;      ///< [rad]
  Eigen::VectorXd dq;     ///< [rad/s]
  Eigen::MatrixXd ahead;  ///< of a motion: the following periods, n × at most `ahead` [rad]
};

struct HandOrder {
  Grip grip = Grip::precision;
  double closure = 0.0, force = 0.0;  ///< [1]
};

/// The task from a settled decision to the released object, one step per period:
///   idle → planning → executing {reach, approach, grasp, transport, release, retreat} → done,
/// and from anywhere → failed with a reason. A move has reaches alone, and leaves the hand as it
/// is. While something is missing or the arm lags by half of `tracking_rad`, a motion waits on its
/// path; from a quarter on it is slower. The whole plan exists before the first motion starts.
/// Set-points flow from the first order on (the posture at that time is held) and end with a fault
/// of arm or hand: silence stops the drives. After done or failed a new order starts again.
class TaskSequence {
 public:
  enum class State { idle, planning, executing, done, failed };

  explicit TaskSequence(const SequenceSettings& settings);

  void step(const SequenceInput& input);

  /// Call once after a step that needs a plan.
  std::optional<PlanRequest> take_request() { return std::exchange(request_, std::nullopt); }
  /// The answer, before the next step.
  void set_plan(tl::expected<TaskPlan, Status> plan);

  State state() const { return state_; }
  Phase phase() const { return phase_; }
  const std::string& reason() const { return reason_; }
  /// Input without which the next order cannot begin ("the scene"); empty: none, or no order.
  const std::string& awaited() const { return awaited_; }
  /// Null: of a move, or before the first order.
  const Task* task() const { return std::get_if<Task>(&order_.what); }
  std::uint64_t order_id() const { return order_.id; }  ///< the order begun last; 0: none
  bool at_rest() const { return state_ != State::planning && state_ != State::executing; }
  bool plan_succeeded() const { return plan_.has_value() && state_ != State::failed; }
  const std::optional<TaskPlan>& plan() const { return plan_; }
  /// set-point of this step; empty: none is sent
  const std::optional<SetPoint>& set_point() const { return set_point_; }
  /// empty before the first task
  const std::optional<HandOrder>& hand_order() const { return hand_; }
  /// Index into plan().motions that this step started.
  std::optional<std::size_t> started_motion() const { return started_; }

 private:
  enum class Stop { object_moved, object_lost, obstacle_moved, aborted };

  void await_inputs(const SequenceInput& input);
  void begin(const SequenceInput& input);
  void plan_from_here(const SequenceInput& input);
  void step_planning(const SequenceInput& input);
  void step_executing(const SequenceInput& input);
  void step_motion(const SequenceInput& input);
  void step_grasp(const HandReading& hand);
  void step_release(const HandReading& hand);
  void start_motion(std::size_t index);
  void motion_ended();
  std::optional<Stop> reason_to_stop(const SequenceInput& input) const;
  bool healthy(const SequenceInput& input);
  void abort();
  bool object_moved(const kin::Table& table) const;
  void fail(std::string reason, bool silent);
  bool late(double limit_s) const { return waited_s_ > limit_s; }

  SequenceSettings settings_;
  State state_ = State::idle;
  Phase phase_ = Phase::reach;
  std::string reason_;
  Order order_{Move{}};  // begun last
  std::uint64_t awaiting_id_ = 0;
  std::string awaited_;
  std::optional<kin::Table> table_;  // the plan's
  std::optional<PlanRequest> request_;
  std::optional<TaskPlan> plan_;
  std::optional<SetPoint> set_point_;
  std::optional<HandOrder> hand_;
  std::vector<kin::Ball> held_;  // of the object grasped last
  std::optional<std::size_t> started_;
  Playback playback_;
  std::size_t motion_ = 0;
  std::optional<Stop> stop_;  // why the motion brakes
  double waited_s_ = 0.0;     // time since the awaited condition changed
};

}  // namespace mimesis::planner
