#include "nodes/planner/task_sequence.h"

#include <algorithm>
#include <cmath>

namespace mimesis::planner {
namespace {

constexpr double kClosedOnNothing = 0.98;  // closure of an empty hand [1]
// Shares of `tracking_rad`: an arm that lags by more slows the motion down, or makes it wait.
constexpr double kSlower = 0.25, kWaits = 0.5;

std::string degrees(double rad) { return std::to_string(std::lround(rad * 180.0 / M_PI)) + " deg"; }

}  // namespace

TaskSequence::TaskSequence(const SequenceSettings& settings)
    : settings_(settings), playback_(settings.a_max_rad_s2) {}

void TaskSequence::step(const SequenceInput& input) {
  started_.reset();
  waited_s_ += input.periods * settings_.period_s;
  if (input.abort) abort();
  awaited_.clear();
  if (at_rest()) {
    if (input.order != nullptr && input.order->id != order_.id) await_inputs(input);
    return;
  }
  if (!healthy(input)) return;
  if (state_ == State::planning) {
    step_planning(input);
  } else {
    step_executing(input);
  }
}

void TaskSequence::await_inputs(const SequenceInput& input) {
  if (awaiting_id_ != input.order->id) {
    awaiting_id_ = input.order->id;
    waited_s_ = 0.0;
  }
  const char* missing = input.table == nullptr  ? "the scene"
                        : input.arm == nullptr  ? "the state of the arm"
                        : input.hand == nullptr ? "the state of the hand"
                                                : nullptr;
  if (missing == nullptr) return begin(input);
  if (!late(settings_.ready_s)) return void(awaited_ = missing);
  order_ = *input.order;
  fail(std::string("waited in vain for ") + missing, true);
}

void TaskSequence::begin(const SequenceInput& input) {
  order_ = *input.order;
  plan_.reset();
  if (task() != nullptr && !settings_.has_hand) return fail("the arm has no hand", false);
  if (const Task* wanted = task()) hand_ = HandOrder{wanted->grip, 0.0, settings_.grip_force};
  if (!set_point_) set_point_ = {input.arm->q, Eigen::VectorXd::Zero(input.arm->q.size()), {}};
  plan_from_here(input);
}

/// On the table as it is now, or was last.
void TaskSequence::plan_from_here(const SequenceInput& input) {
  if (auto* move = std::get_if<Move>(&order_.what)) {
    if (input.hand->object_detected && held_.empty())
      return fail("the hand holds an object of unknown size", false);
    if (plan_ && !plan_->passed.empty()) {  // what it has passed
      const auto passed = static_cast<std::ptrdiff_t>(plan_->passed[motion_]);
      move->via.erase(move->via.begin(), move->via.begin() + passed);
    }
  }
  state_ = State::planning;
  phase_ = Phase::reach;
  reason_.clear();
  plan_.reset();
  if (input.table != nullptr) table_ = *input.table;
  request_ = PlanRequest{*table_, set_point_->q, order_.what,
                         input.hand->object_detected ? held_ : std::vector<kin::Ball>{}};
  stop_.reset();
  waited_s_ = 0.0;
}

void TaskSequence::abort() {
  if (at_rest()) return;
  const bool moves =
      state_ == State::executing && phase_ != Phase::grasp && phase_ != Phase::release;
  if (moves) {
    stop_ = Stop::aborted;
  } else {
    fail("aborted", false);
  }
}

void TaskSequence::set_plan(tl::expected<TaskPlan, Status> plan) {
  if (state_ != State::planning) return;
  if (!plan) return fail(plan.error().reason, false);
  plan_ = std::move(*plan);
  motion_ = 0;
  waited_s_ = 0.0;
}

void TaskSequence::step_planning(const SequenceInput& input) {
  if (!plan_) {
    if (late(settings_.planning_s)) fail("planning took too long", false);
    return;
  }
  if (input.table != nullptr && object_moved(*input.table)) return plan_from_here(input);
  if (plan_->motions.empty()) {
    state_ = State::done;
    return;
  }
  if (!input.arm->operational || !input.hand->active) {
    if (late(settings_.ready_s)) {
      fail(input.arm->operational ? "the hand is not active" : "the arm is not operational", false);
    }
    return;
  }
  if ((input.arm->q - set_point_->q).cwiseAbs().maxCoeff() > settings_.arrival_rad) {
    // It sagged or was moved before it was enabled: hold and plan from where it is.
    set_point_->q = input.arm->q;
    return plan_from_here(input);
  }
  state_ = State::executing;
  start_motion(0);
}

void TaskSequence::start_motion(std::size_t index) {
  motion_ = index;
  phase_ = plan_->motions[index].phase;
  playback_.start(plan_->motions[index].trajectory);
  if (const auto& held = plan_->motions[index].obstacles.held; !held.empty()) held_ = held;
  started_ = index;
  waited_s_ = 0.0;
}

void TaskSequence::step_executing(const SequenceInput& input) {
  if (phase_ == Phase::grasp) return step_grasp(*input.hand);
  if (phase_ == Phase::release) return step_release(*input.hand);
  step_motion(input);
}

void TaskSequence::step_motion(const SequenceInput& input) {
  if (!stop_) stop_ = reason_to_stop(input);
  const double away = (input.arm->q - set_point_->q).cwiseAbs().maxCoeff();
  const double lag = away / settings_.tracking_rad;
  const std::string missing = input.missing.empty() && lag > kWaits ? "the arm" : input.missing;
  // In the periods left out the bridge went on as the last command told it.
  for (int i = 1; i < input.periods; ++i) playback_.advance();
  const bool waits = stop_.has_value() || !missing.empty();
  playback_.aim_at(waits ? 0.0 : std::clamp((kWaits - lag) / (kWaits - kSlower), 0.0, 1.0));
  reason_ = missing.empty() ? "" : "waits for " + missing;
  if (!playback_.at_rest()) {
    playback_.advance();
    set_point_ = {playback_.position(), playback_.velocity(), playback_.ahead(settings_.ahead)};
    waited_s_ = 0.0;
    return;
  }
  if (!missing.empty() && !stop_ && !playback_.ended()) {
    if (late(settings_.resume_s)) fail("waited in vain for " + missing, false);
    return;
  }
  if (away > settings_.arrival_rad) {
    if (late(settings_.settle_s))
      fail("the arm did not arrive, it is " + degrees(away) + " off", false);
    return;
  }
  if (stop_ == Stop::aborted) return fail("aborted", false);
  if (stop_ == Stop::object_lost) return fail("the object was lost in transport", false);
  const auto* move = std::get_if<Move>(&order_.what);
  const bool fixed_way = move != nullptr && !move->tool.empty();  // there is no other
  if (stop_ == Stop::obstacle_moved && (phase_ != Phase::reach || fixed_way))
    return fail("an obstacle moved into the way", false);
  if (stop_ && fixed_way) return fail("the object moved", false);
  if (stop_) {
    if (input.table != nullptr) plan_from_here(input);
    return;
  }
  // The open hand goes round the object: it must be open before the approach.
  if (phase_ == Phase::reach && task() != nullptr &&
      (input.hand->closure > settings_.open_closure || input.hand->moving)) {
    if (late(settings_.hand_s)) fail("the hand does not open", false);
    return;
  }
  motion_ended();
}

std::optional<TaskSequence::Stop> TaskSequence::reason_to_stop(const SequenceInput& input) const {
  const bool holds = phase_ == Phase::transport || !plan_->motions[motion_].obstacles.held.empty();
  if (holds && !input.hand->object_detected) return Stop::object_lost;
  if (phase_ == Phase::reach && !holds && input.table != nullptr && object_moved(*input.table)) {
    return Stop::object_moved;
  }
  if (settings_.keeps_clear && input.table != nullptr &&
      !settings_.keeps_clear(*plan_, motion_, *table_, *input.table)) {
    return Stop::obstacle_moved;
  }
  return std::nullopt;
}

void TaskSequence::motion_ended() {
  waited_s_ = 0.0;
  const auto& motions = plan_->motions;
  const bool last_of_phase = motion_ + 1 == motions.size() || motions[motion_ + 1].phase != phase_;
  if (phase_ == Phase::approach && last_of_phase) {
    phase_ = Phase::grasp;
    hand_->closure = 1.0;
  } else if (phase_ == Phase::transport && last_of_phase) {
    phase_ = Phase::release;
    hand_->closure = 0.0;
  } else if (motion_ + 1 == motions.size()) {
    state_ = State::done;
  } else {
    start_motion(motion_ + 1);
  }
}

void TaskSequence::step_grasp(const HandReading& hand) {
  if (hand.object_detected && !hand.moving) return start_motion(motion_ + 1);
  if (!hand.moving && hand.closure > kClosedOnNothing) {
    return fail("the hand closed, but no object was detected", false);
  }
  if (late(settings_.hand_s)) fail("no grasp: the hand did not close in time", false);
}

void TaskSequence::step_release(const HandReading& hand) {
  if (!hand.moving && hand.closure < settings_.open_closure) return start_motion(motion_ + 1);
  if (late(settings_.hand_s)) fail("the hand does not open to release the object", false);
}

bool TaskSequence::healthy(const SequenceInput& input) {
  const auto& arm = input.arm;
  const auto& hand = input.hand;
  if (arm == nullptr) {
    fail("the arm's state is stale", true);
  } else if (hand == nullptr) {
    fail("the hand's state is stale", true);
  } else if (!arm->fault.empty()) {
    fail("arm: " + arm->fault, true);
  } else if (!hand->fault.empty()) {
    fail("hand: " + hand->fault, true);
  } else if (state_ == State::executing && !arm->operational) {
    fail("the arm is no longer operational", true);
  } else if (state_ == State::executing && !hand->active) {
    fail("the hand is not active", true);
  } else if (state_ == State::executing) {
    Eigen::Index joint = 0;
    const double away = (arm->q - set_point_->q).cwiseAbs().maxCoeff(&joint);
    if (away > settings_.tracking_rad) {
      fail("joint " + std::to_string(joint + 1) + " is " + degrees(away) + " off its set-point",
           true);
    }
  }
  return state_ != State::failed;
}

bool TaskSequence::object_moved(const kin::Table& table) const {
  return (table.object - table_->object).norm() > settings_.object_moved_m;
}

void TaskSequence::fail(std::string reason, bool silent) {
  state_ = State::failed;
  reason_ = std::move(reason);
  request_.reset();
  if (set_point_) set_point_ = {set_point_->q, 0.0 * set_point_->dq, {}};
  if (silent) set_point_.reset();
}

}  // namespace mimesis::planner
