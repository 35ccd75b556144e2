#include "nodes/synthesizer/drawer/drawer_sequence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nodes/synthesizer/control/transition.h"
#include "nodes/synthesizer/drawer/smooth.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kPi = std::numbers::pi, kTurn = 2.0 * kPi;
// Shares of an action at which events happen; as people did in the trials.
constexpr double kLeftReaches = 0.30;               // of action 2, until its end
constexpr double kPullFrom = 0.05, kPullTo = 0.65;  // of action 3
constexpr double kRightReaches = 0.20, kRightArrives = 0.95;
constexpr double kLetGo = 0.4;    // s, after an interrupted stand
constexpr double kFollow = 0.06;  // s, of a hand's aim after its target
constexpr double kEdge = 0.15;    // share of an action at whose ends the learned course fades out

// Source k at phase φ in [0, 2π): between samples linearly; the ramp in closed form.
double source(const MotionModel& model, Eigen::Index k, double phase_rad) {
  if (k < model.fixed) return std::cos(0.5 * phase_rad);
  const auto n = model.sources.cols();
  double at = phase_rad / kTurn * static_cast<double>(n);
  at -= std::floor(at / static_cast<double>(n)) * static_cast<double>(n);
  const auto i = std::min(static_cast<Eigen::Index>(at), n - 1);
  const double u = at - static_cast<double>(i);
  return (1.0 - u) * model.sources(k, i) + u * model.sources(k, (i + 1) % n);
}

Eigen::VectorXd mixture_at(const MotionModel& model, const MotionParameters& p, double phase_rad) {
  Eigen::VectorXd rows = p.mean_rad;
  for (Eigen::Index r = 0; r < rows.size(); ++r)
    for (Eigen::Index k = 0; k < p.weight_rad.cols(); ++k)
      if (p.weight_rad(r, k) != 0.0)
        rows(r) += p.weight_rad(r, k) * source(model, k, phase_rad - p.delay_rad(r, k));
  return rows;
}

void settle(MotionParameters& p, const MotionParameters& wanted, double share) {
  p.mean_rad += share * (wanted.mean_rad - p.mean_rad);
  p.weight_rad += share * (wanted.weight_rad - p.weight_rad);
  p.frequency_rad_s += share * (wanted.frequency_rad_s - p.frequency_rad_s);
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
    : maps_(&maps), goal_(goal), options_(options), plan_(std::move(plan)) {
  // the walker comes along with cycles like the first one
  previous_length_m_ = maps.ranges().normal.mean_m;
  state_.angle_rad = Eigen::VectorXd::Zero(mocap::kBodyRows);
  state_.number = -1;
  begin_action();
  current_ = wanted_;
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

// The first action of the plan becomes the one under way.
void DrawerSequence::begin_action() {
  state_.action = plan_.front().action;
  ++state_.number;
  start_x_m_ = state_.pelvis_W_m.x();
  even_m_ = 0.0;
  history_.push_back(plan_.front());
  wanted_ = parameters(0);
  next_.reset();
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
  if (!goal_changed_ || next_) return;
  goal_changed_ = false;
  const double share = std::min(state_.phase_rad / kTurn, 0.999);
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
    wanted_ = parameters(0);
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
  previous_.reset();
  opened_m_ = 0.0;
  begin_action();
  current_ = wanted_;
}

void DrawerSequence::advance_phase() {
  const double window = options_.beta * kPi;
  if (!next_ && plan_.size() > 1 && state_.phase_rad > kTurn - window) next_ = parameters(1);
  settle(current_, wanted_, 1.0 - std::exp(-options_.dt_s / options_.settle_s));
  double phase = state_.phase_rad;
  mixed_ = current_;
  if (next_) {
    transition(current_, *next_, 1, phase - kTurn, options_.beta, mixed_);
  } else if (previous_ && phase < window) {
    transition(*previous_, current_, 1, phase, options_.beta, mixed_);
  }
  phase += mixed_.frequency_rad_s * options_.dt_s;
  if (phase < kTurn) {
    state_.phase_rad = phase;
    return;
  }
  if (plan_.size() == 1) {  // the stand is over
    state_.phase_rad = std::nextafter(kTurn, 0.0);
    state_.done = true;
    return;
  }
  // even if the pelvis is a little off, the next action starts where it is
  previous_length_m_ = plan_.front().length_m;
  previous_ = current_;
  current_ = *next_;
  state_.phase_rad = phase - kTurn;
  state_.pelvis_W_m.x() = start_x_m_ + plan_.front().length_m;
  plan_.erase(plan_.begin());
  begin_action();
  current_.delay_rad = wanted_.delay_rad;
}

Eigen::VectorXd DrawerSequence::mixed() {
  const double window = options_.beta * kPi;
  mixed_ = current_;
  if (next_)
    transition(current_, *next_, 1, state_.phase_rad - kTurn, options_.beta, mixed_);
  else if (previous_ && state_.phase_rad < window)
    transition(*previous_, current_, 1, state_.phase_rad, options_.beta, mixed_);
  Eigen::VectorXd rows = mixture_at(maps_->model().action[0], mixed_, state_.phase_rad);
  if (left_behind_) {
    const double in = minimum_jerk(state_.time_s - left_behind_s_, 0.0, kLetGo);
    rows = (1.0 - in) * *left_behind_ + in * rows;
    if (in >= 1.0) left_behind_.reset();
  }
  return rows;
}

// Along the way by the action's length, evenly but for the learned course; what a changed length
// leaves is spread over the rest of the action.
void DrawerSequence::move_pelvis(const Eigen::VectorXd& rows) {
  const double share = state_.phase_rad / kTurn;
  const double edge =
      minimum_jerk(share, 0.0, kEdge) * (1.0 - minimum_jerk(share, 1.0 - kEdge, 1.0));
  state_.pelvis_W_m << start_x_m_ + even_m_ + edge * rows(mocap::kBodyRows),
      rows(mocap::kBodyRows + 1), rows(mocap::kBodyRows + 2);
}

// The left hand opens the drawer as time goes on, once it holds the handle. After a jump the hands'
// aims follow within tenths of a second; a hand that lets go does so where it was.
void DrawerSequence::move_drawer() {
  const DrawerModel& model = maps_->model();
  const double share = state_.phase_rad / kTurn;
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
  const double share = state_.phase_rad / kTurn;
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
  even_m_ += (plan_.front().length_m - even_m_) * (state_.phase_rad - from) / (kTurn - from);
  const Eigen::VectorXd rows = mixed();
  move_pelvis(rows);
  state_.angle_rad = rows.head(mocap::kBodyRows);
  feet_.apply(maps_->model().body, state_.pelvis_W_m, options_.dt_s, state_.angle_rad);
  state_.stands = {feet_.stands(mocap::kLeft), feet_.stands(mocap::kRight)};
  state_.correction_m = feet_.correction_m();
  move_hands();
  return state_;
}

}  // namespace mimesis::synthesizer
