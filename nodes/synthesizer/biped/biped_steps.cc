#include <algorithm>
#include <cmath>
#include <utility>

#include "nodes/synthesizer/biped/biped_sequence.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kSideBySide_m = 0.05;  // feet that may stand so

mocap::Side other(mocap::Side side) { return side == mocap::kLeft ? mocap::kRight : mocap::kLeft; }

}  // namespace

/// Index of the last step of the action that step `first` belongs to.
std::size_t BipedDrawerSequence::end_of_action(std::size_t first) const {
  while (first + 1 < plan_.steps.size() && plan_.steps[first].side != mocap::kLeft) ++first;
  return first;
}

/// Middle of the feet after a step of the plan.
double BipedDrawerSequence::middle_after(std::size_t step) const {
  const PlannedStep& s = plan_.steps[step];
  return 0.5 * (s.x_m + (step > 0 ? plan_.steps[step - 1].x_m : foot_m(other(s.side))));
}

std::vector<PlannedAction> BipedDrawerSequence::plan() const {
  std::vector<PlannedAction> actions;
  double start = action_start_m_;
  for (std::size_t i = 0; i < plan_.steps.size();) {
    const std::size_t end = end_of_action(i);
    const double middle = middle_after(end);
    actions.push_back({plan_.steps[end].action, middle - start, 2.0 * options_.step_s});
    start = middle;
    i = end + 1;
  }
  actions.push_back({kStanding, 0.0, drawer_->actions.ranges().standing_s});
  return actions;
}

void BipedDrawerSequence::see(const RobotFeedback* robot) {
  if (robot != nullptr) {
    robot_ = *robot;
    believed_.place(robot_);
  } else {
    believed_.step(state_.landing, !plan_.steps.empty());
    robot_ = believed_.feedback();
    robot_.hands_known = false;
  }
  clock_.step(&robot_, !plan_.steps.empty());
  const bool moving = robot_.moves();
  const bool foot_landed =
      was_moving_ && (robot_.steps != last_steps_ || !moving || robot_.swing != last_swing_);
  if (foot_landed) landed(last_swing_);
  last_swing_ = robot_.swing;
  last_steps_ = robot_.steps;
  was_moving_ = moving;
  const bool otherwise = moving && !plan_.steps.empty() && plan_.steps[0].side != robot_.swing;
  if (task_changed_ || foot_landed || otherwise) replan();
}

void BipedDrawerSequence::landed(mocap::Side side) {
  across_m_ += std::clamp(front_across_m_ - across_m_, -options_.aside_m, options_.aside_m);
  if (plan_.steps.empty() || plan_.steps.front().side != side) return;
  const bool ends = plan_.steps.front().side == mocap::kLeft;
  plan_.steps.erase(plan_.steps.begin());
  if (!ends) return;
  history_.back().length_m = middle_m() - action_start_m_;
  previous_length_m_ = history_.back().length_m;
  begin_action();
}

/// Steps from where the feet are; a foot that is about to land, from where it will.
void BipedDrawerSequence::replan() {
  const bool elsewhere = std::exchange(task_changed_, false);
  const bool moving = robot_.moves();
  if (!moving) robot_.swing = mocap::kRight;  // begins with a whole action
  FeetAlongWay feet{.support_m = foot_m(other(robot_.swing)),
                    .other_m = foot_m(robot_.swing),
                    .swing = robot_.swing,
                    .action = state_.action,
                    .stands = !moving};
  std::optional<PlannedStep> kept;
  if (moving && robot_.to_landing_s < options_.fixed_s && !plan_.steps.empty() &&
      plan_.steps[0].side == robot_.swing) {
    kept = plan_.steps[0];
    kept->x_m = on_way(robot_.landing.p_W_m).x();
    feet.other_m = feet.support_m;
    feet.support_m = kept->x_m;
    feet.swing = other(robot_.swing);
    feet.action = kept->action;
  } else if (moving && robot_.swing == mocap::kRight) {
    feet.other_m = foot_m(mocap::kRight);  // in the air: where it was does not count
  }
  const bool beside = std::abs(feet.support_m - feet.other_m) < kSideBySide_m;
  if (moving && feet.swing == mocap::kRight && beside && plan_.steps.size() <= (kept ? 1U : 0U)) {
    feet.stands = true;
  }
  auto plan = plan_steps(feet, front_m_, comfortable_m(), plan_settings_);
  state_.refused = plan ? "" : plan.error().reason;
  if (!plan) {
    halt();
    return;
  }
  plan_ = std::move(*plan);
  if (kept) plan_.steps.insert(plan_.steps.begin(), *kept);
  if (state_.number < 0) return;
  const bool stood = state_.action == kStanding, stands = plan_.steps.empty();
  const bool last = plan_.steps.size() <= 2 && !stands && plan_.steps[0].action == kReachingStep;
  const bool anew = stood && elsewhere;  // what was done of the stand is in vain
  if (anew || (!stands && !last)) release();
  if (stood != stands || halted_ || anew) {
    from_stand_ = !moving;
    halted_ = false;
    begin_action();
    return;
  }
  wanted_ = wanted();
  if (stands) return;
  state_.action = plan_.steps[0].action;
  history_.back() = this->plan().front();
  has_next_ = false;
  if (const Action kind = played(0); kind != kind_) {  // the arms are at something else
    kind_ = kind;
    current_ = wanted_;
    has_previous_ = false;
    fade_begins_ = true;
  }
}

/// No plan leads to the drawer: the robot stops as soon as it can, and its hands come back.
void BipedDrawerSequence::halt() {
  halted_ = true;
  plan_.steps.clear();
  has_next_ = false;
  release();
}

SolePrint BipedDrawerSequence::print(const PlannedStep& step, int steps_ahead) const {
  const double shift = (steps_ahead + 1) * options_.aside_m;
  const double across = across_m_ + std::clamp(front_across_m_ - across_m_, -shift, shift);
  const double apart = (step.side == mocap::kLeft ? 0.5 : -0.5) * drawer_->feet_distance_m;
  return {.side = step.side, .p_W_m = in_world({step.x_m, across + apart}), .yaw_rad = heading_};
}

void BipedDrawerSequence::wish_landings() {
  state_.landing = {};
  const auto& steps = plan_.steps;
  const bool moving = robot_.moves();
  state_.stands = steps.empty() || (moving && robot_.gait != RobotGait::starting &&
                                    steps.size() <= 2 && steps.front().action == kReachingStep);
  if (!steps.empty()) {
    state_.landing[0] = print(steps[0], 0);
    state_.landing[1] = steps.size() > 1 ? print(steps[1], 1) : robot_.feet[other(steps[0].side)];
  } else if (moving) {  // steps on the spot
    const mocap::Side support = other(robot_.swing);
    state_.landing[0] = print({kReachingStep, robot_.swing, foot_m(support)}, 0);
    state_.landing[1] = robot_.feet[support];
  }
}

}  // namespace mimesis::synthesizer
