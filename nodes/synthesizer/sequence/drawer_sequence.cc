#include "nodes/synthesizer/sequence/drawer_sequence.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "nodes/synthesizer/character/smooth.h"

namespace mimesis::synthesizer {

namespace {

// Shares of an action at which events happen; as people did in the trials.
constexpr double kLeftReaches = 0.30;               // share of action 2 until its end
constexpr double kPullFrom = 0.05, kPullTo = 0.65;  // part of action 3
constexpr double kRightReaches = 0.20, kRightArrives = 0.95;
constexpr double kLetGo = 0.4;    // s, after an interrupted stand
constexpr double kFollow = 0.06;  // s, of a hand's aim after its target
constexpr double kEdge = 0.15;    // share of an action at whose ends the learned course fades out

Eigen::Vector2d rotated(const Eigen::Vector2d& p, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  return {c * p.x() - s * p.y(), s * p.x() + c * p.y()};
}

}  // namespace

tl::expected<DrawerSequence, Status> DrawerSequence::start(const ActionMaps& maps,
                                                           const DrawerGoal& goal,
                                                           const SequenceOptions& options) {
  auto plan = plan_actions(goal.front_W_m, maps.ranges(), options.plan);
  if (!plan) return tl::make_unexpected(plan.error());
  return DrawerSequence(maps, goal, options, std::move(*plan));
}

DrawerSequence::DrawerSequence(const ActionMaps& maps, const DrawerGoal& goal,
                               const SequenceOptions& options, std::vector<PlannedAction> plan)
    : maps_(&maps),
      goal_(goal),
      options_(options),
      plan_(std::move(plan)),
      course_(options.beta, options.settle_s, options.dt_s) {
  // the walker comes along with cycles like the first one
  previous_length_m_ = maps.ranges().normal.mean_m;
  state_.angle_rad = Eigen::VectorXd::Zero(mocap::kBodyRows);
  state_.number = -1;
  begin_action();
  course_.restart();
}

MotionParameters DrawerSequence::parameters(std::size_t index) const {
  const PlannedAction& a = plan_[index];
  double distance = goal_.front_W_m - start_x_m_;
  for (std::size_t i = 0; i <= index; ++i) distance -= plan_[i].length_m;
  return maps_->at(
      a.action, {.length_m = a.length_m,
                 .duration_s = a.duration_s,
                 .previous_length_m = index == 0 ? previous_length_m_ : plan_[index - 1].length_m,
                 .final_distance_m = distance,
                 .object_depth_m = goal_.object_depth_m,
                 .object_lateral_m = goal_.object_lateral_m});
}

void DrawerSequence::begin_action() {
  state_.action = plan_.front().action;
  ++state_.number;
  start_x_m_ = state_.pelvis_W_m.x();
  even_m_ = 0.0;
  history_.push_back(plan_.front());
  course_.want(parameters(0));
  course_.drop_next();
}

void DrawerSequence::set_goal(const DrawerGoal& goal) {
  if (goal == goal_) return;
  const Eigen::Vector3d front(goal_.front_W_m - goal.front_W_m, 0.0, 0.0);
  left_gap_m_ += front;
  right_gap_m_ += front + Eigen::Vector3d(goal_.object_depth_m - goal.object_depth_m,
                                          goal_.object_lateral_m - goal.object_lateral_m, 0.0);
  goal_ = goal;
  goal_changed_ = true;
  if (state_.done) state_.done = false;
}

// A new plan from where the walker is. Not while the next action is blended in: then just after.
void DrawerSequence::follow_goal() {
  if (!goal_changed_ || course_.has_next()) return;
  goal_changed_ = false;
  const double share = std::min(state_.phase_rad / math::kTwoPi, 0.999);
  const Underway now{state_.action, plan_.front().length_m, even_m_, share};
  auto plan =
      replan_actions(now, goal_.front_W_m - start_x_m_ - even_m_, maps_->ranges(), options_.plan);
  state_.refused = plan ? "" : plan.error().reason;
  if (!plan) return;
  const bool walks_on = state_.action == kStanding && plan->front().action != kStanding;
  if (!walks_on) {
    plan->front().duration_s = plan_.front().duration_s;  // the pace of an action stays
    plan_ = std::move(*plan);
    history_.back() = plan_.front();
    course_.want(parameters(0));
    if (plan_.size() > 1 && plan_[1].action != kStanding && left_started_) {
      left_.start(false, kLetGo);
      left_started_ = false;
    }
    return;
  }
  left_.start(false, kLetGo);
  right_.start(false, kLetGo);
  left_started_ = right_started_ = false;
  left_behind_ = mixed();
  left_behind_s_ = state_.time_s;
  previous_length_m_ = maps_->ranges().normal.least_m;
  plan_ = std::move(*plan);
  state_.phase_rad = 0.0;
  opened_m_ = 0.0;
  begin_action();
  course_.restart();
}

void DrawerSequence::advance_phase() {
  if (!course_.has_next() && plan_.size() > 1 && course_.near_end(state_.phase_rad)) {
    course_.set_next(parameters(1));
  }
  course_.settle();
  const double rate_rad_s = course_.at(state_.phase_rad).frequency_rad_s;
  const double phase = state_.phase_rad + rate_rad_s * options_.dt_s;
  if (phase < math::kTwoPi) {
    state_.phase_rad = phase;
    return;
  }
  if (plan_.size() == 1) {  // the stand is over
    state_.phase_rad = std::nextafter(math::kTwoPi, 0.0);
    state_.done = true;
    return;
  }
  // even if the pelvis is a little off, the next action starts where it is
  previous_length_m_ = plan_.front().length_m;
  course_.cross();
  state_.phase_rad = phase - math::kTwoPi;
  state_.pelvis_W_m.x() = start_x_m_ + plan_.front().length_m;
  plan_.erase(plan_.begin());
  begin_action();
  course_.take_wanted_delays();
}

Eigen::VectorXd DrawerSequence::mixed() {
  Eigen::VectorXd rows(kDrawerRows);
  mixture_at(maps_->model().action[0], course_.at(state_.phase_rad), state_.phase_rad,
             Between::linear, rows);
  if (left_behind_) {
    const double in = minimum_jerk(state_.time_s - left_behind_s_, 0.0, kLetGo);
    rows = (1.0 - in) * *left_behind_ + in * rows;
    if (in >= 1.0) left_behind_.reset();
  }
  return rows;
}

// Along the way by the action's length, evenly except for the learned course; a changed length is
// spread over the rest of the action.
void DrawerSequence::move_pelvis(const Eigen::VectorXd& rows) {
  const double share = state_.phase_rad / math::kTwoPi;
  const double edge =
      minimum_jerk(share, 0.0, kEdge) * (1.0 - minimum_jerk(share, 1.0 - kEdge, 1.0));
  state_.pelvis_W_m << start_x_m_ + even_m_ + edge * rows(mocap::kBodyRows),
      rows(mocap::kBodyRows + 1), rows(mocap::kBodyRows + 2);
}

// The left hand opens the drawer as time goes on, once it holds the handle. After a jump the hands'
// aims follow within tenths of a second; a hand that lets go does so where it was.
void DrawerSequence::move_drawer() {
  const DrawerModel& model = maps_->model();
  const double share = state_.phase_rad / math::kTwoPi;
  if (state_.action == kStanding && left_.share() > 0.95)
    opened_m_ = std::max(opened_m_, model.drawer.pull_m * minimum_jerk(share, kPullFrom, kPullTo));
  const double front = goal_.front_W_m - opened_m_;
  state_.handle_W_m << front, model.drawer.handle_lateral_m, model.drawer.handle_height_m;
  state_.object_W_m << front + goal_.object_depth_m, goal_.object_lateral_m,
      model.drawer.object_height_m;
  const double fade = std::exp(-options_.dt_s / kFollow);
  left_gap_m_ *= fade;
  right_gap_m_ *= fade;
  if (left_started_) left_aim_W_m_ = state_.handle_W_m + left_gap_m_;
  if (right_started_) right_aim_W_m_ = state_.object_W_m + right_gap_m_;
}

void DrawerSequence::move_hands() {
  const double share = state_.phase_rad / math::kTwoPi;
  const bool last_step = state_.action == kReachingStep && plan_.size() == 2;
  const double turn_s = plan_.front().duration_s;
  if (!left_started_ && ((last_step && share >= kLeftReaches) || state_.action == kStanding)) {
    left_.start(true, std::max(0.25, (1.0 - share) * turn_s * (last_step ? 0.97 : 0.2)));
    left_started_ = true;
  }
  if (!right_started_ && state_.action == kStanding && share >= kRightReaches) {
    right_.start(true, (kRightArrives - share) * turn_s);
    right_started_ = true;
  }
  left_.step(options_.dt_s);
  right_.step(options_.dt_s);
  move_drawer();
  const mocap::Body& body = maps_->model().body;
  auto miss = [&](double* left_m, double* right_m) {
    const auto pose = forward_kinematics(
        body, std::span<const double, mocap::kBodyRows>(state_.angle_rad.data(), mocap::kBodyRows),
        state_.pelvis_W_m);
    *left_m = (pose.point(mocap::kLeftWrist, body.hand_m[mocap::kLeft]) - state_.handle_W_m).norm();
    *right_m =
        (pose.point(mocap::kRightWrist, body.hand_m[mocap::kRight]) - state_.object_W_m).norm();
  };
  miss(&state_.left_without_m, &state_.right_without_m);
  left_.apply(body, mocap::kLeft, state_.pelvis_W_m, left_aim_W_m_, state_.angle_rad);
  right_.apply(body, mocap::kRight, state_.pelvis_W_m, right_aim_W_m_, state_.angle_rad);
  miss(&state_.left_error_m, &state_.right_error_m);
}

const SequenceState& DrawerSequence::step() {
  state_.time_s += options_.dt_s;
  follow_goal();
  if (state_.done) return state_;
  const double before = state_.phase_rad;
  const int number = state_.number;
  advance_phase();
  const double from = state_.number == number ? before : 0.0;
  even_m_ += (plan_.front().length_m - even_m_) * (state_.phase_rad - from) / (math::kTwoPi - from);
  const Eigen::VectorXd rows = mixed();
  move_pelvis(rows);
  state_.angle_rad = rows.head(mocap::kBodyRows);
  feet_.apply(maps_->model().body, state_.pelvis_W_m, options_.dt_s, state_.angle_rad);
  state_.stands = {feet_.stands(mocap::kLeft), feet_.stands(mocap::kRight)};
  state_.correction_m = feet_.correction_m();
  move_hands();
  return state_;
}

tl::expected<PlacedSequence, Status> PlacedSequence::start(const ActionMaps& maps,
                                                           const DrawerPlace& place,
                                                           const Eigen::Vector2d& from_W_m,
                                                           double dt_s) {
  const Eigen::Vector2d way = place.front_W_m - from_W_m;
  DrawerGoal goal;
  goal.front_W_m = way.norm();
  goal.object_depth_m = place.object_depth_m;
  SequenceOptions options;
  options.dt_s = dt_s;
  auto sequence = DrawerSequence::start(maps, goal, options);
  if (!sequence) return tl::make_unexpected(sequence.error());
  PlacedSequence run(std::move(*sequence), place, from_W_m, std::atan2(way.y(), way.x()));
  run.step();  // its first posture
  return run;
}

std::string PlacedSequence::move(const DrawerPlace& place) {
  const Eigen::Vector2d way = rotated(place.front_W_m - from_, -heading_rad_);
  if (std::abs(way.y()) > kAcross_m) {
    return "the drawer moved " + std::to_string(way.y()) + " m across the way to it";
  }
  DrawerGoal goal;
  goal.front_W_m = way.x();
  goal.object_depth_m = place.object_depth_m;
  goal.object_lateral_m = way.y();
  sequence_.set_goal(goal);
  place_ = place;
  return {};
}

void PlacedSequence::step() { sequence_.step(); }

Eigen::Vector2d PlacedSequence::position_W_m() const {
  return from_ + rotated(sequence_.state().pelvis_W_m.head<2>(), heading_rad_);
}

const char* PlacedSequence::action() const {
  switch (sequence_.state().action) {
    case kNormalStep:
      return "step";
    case kReachingStep:
      return "reach";
    case kStanding:
      break;
  }
  return "take";
}

}  // namespace mimesis::synthesizer
