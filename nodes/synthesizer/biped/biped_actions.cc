#include <algorithm>
#include <cmath>
#include <numbers>

#include "nodes/synthesizer/biped/biped_sequence.h"
#include "nodes/synthesizer/control/transition.h"
#include "nodes/synthesizer/fade.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kPi = std::numbers::pi, kTurn = math::kTwoPi;
constexpr double kFade_s = 0.8, kAhead_s = 0.1;
constexpr double kLambda_1_s = 20.0;  // of the low-pass of the joints
constexpr double kJump_rad = 0.1;     // of the phase: a robot that begins with the other foot
constexpr double kAcceleration_m_s2 = 0.6;

void settle(MotionParameters& p, const MotionParameters& wanted, double share) {
  p.mean_rad += share * (wanted.mean_rad - p.mean_rad);
  p.weight_rad += share * (wanted.weight_rad - p.weight_rad);
  p.frequency_rad_s += share * (wanted.frequency_rad_s - p.frequency_rad_s);
}

}  // namespace

/// The learned action that is played for the one that begins with this step: arms do not reach in
/// an action 2 after which another one follows; it is a short action 1.
Action BipedDrawerSequence::played(std::size_t first) const {
  if (first >= plan_.steps.size()) return kStanding;
  const std::size_t end = end_of_action(first);
  return end + 1 == plan_.steps.size() ? plan_.steps[end].action : kNormalStep;
}

/// Of the action that begins with step `first` of the plan, from `start_m`.
MotionParameters BipedDrawerSequence::parameters(std::size_t first, double start_m,
                                                 double previous_m) const {
  const LearnedActions& learned = drawer_->actions;
  ActionTask task{.length_m = 0.0,
                  .duration_s = learned.ranges().standing_s,
                  .previous_length_m = previous_m,
                  .final_distance_m = plan_.final_distance_m,
                  .object_depth_m = task_.object_depth_m,
                  .object_lateral_m = 0.0};
  const Action action = played(first);
  if (action == kStanding) return learned.maps().at(action, task);
  task.length_m = middle_after(end_of_action(first)) - start_m;
  task.duration_s = 2.0 * options_.step_s;
  MotionParameters p = learned.maps().at(action, task);
  const double least = learned.ranges().normal.least_m;
  if (action == kNormalStep && task.length_m < least) {
    p.mean_rad.tail<3>() *= task.length_m / least;
    p.weight_rad.bottomRows<3>() *= task.length_m / least;
  }
  return p;
}

MotionParameters BipedDrawerSequence::wanted() const {
  return parameters(0, action_start_m_, previous_length_m_);
}

MotionParameters BipedDrawerSequence::following() const {
  if (plan_.steps.empty()) return wanted();
  const std::size_t end = end_of_action(0);
  const double middle = middle_after(end);
  return parameters(end + 1, middle, middle - action_start_m_);
}

void BipedDrawerSequence::begin_action() {
  const bool stands = plan_.steps.empty();
  ++state_.number;
  state_.action = stands ? kStanding : plan_.steps[0].action;
  kind_ = played(0);
  state_.phase_rad = 0.0;
  waited_s_ = 0.0;
  action_start_m_ = middle_m();
  history_.push_back(plan().front());
  wanted_ = wanted();
  if (state_.number > 0) {
    previous_ = current_;
    has_previous_ = has_next_;
    current_ = has_next_ ? next_ : wanted_;
  }
  if (state_.number > 1) from_stand_ = false;
  has_next_ = false;
  fade_begins_ = true;
}

void BipedDrawerSequence::stand_on(const DrawerSeen* seen) {
  const double share = state_.phase_rad / kTurn;
  const bool no_hold = share >= kPullFrom && share < kPullTo && seen != nullptr && !seen->held;
  const bool over = share >= 1.0 - 1e-9;
  const bool no_object = over && seen != nullptr && !seen->taken;
  state_.phase_rate_rad_s = no_hold || over ? 0.0 : wanted_.frequency_rad_s;
  state_.phase_rad = std::min(state_.phase_rad + options_.dt_s * state_.phase_rate_rad_s,
                              std::nextafter(kTurn, 0.0));
  waited_s_ = no_hold || no_object ? waited_s_ + options_.dt_s : 0.0;
  if (waited_s_ > options_.patience_s) {
    state_.refused = no_hold ? "the left hand does not get hold of the handle"
                             : "the right hand does not get the object";
    waiting_ = true;
  } else if (waited_s_ == 0.0 && waiting_) {
    state_.refused.clear();
    waiting_ = false;
  }
  state_.done = seen != nullptr ? seen->taken : over;
}

void BipedDrawerSequence::advance_phase(const DrawerSeen* seen) {
  if (halted_) {
    state_.phase_rate_rad_s = 0.0;
    return;
  }
  if (state_.action == kStanding) {
    stand_on(seen);
    return;
  }
  // the clock may be a little before or behind the landings that make the actions
  const bool second = !plan_.steps.empty() && plan_.steps[0].side == mocap::kLeft;
  const double middle = second ? 1.5 * kPi : 0.5 * kPi;
  const double off = std::clamp(math::wrap_pi(clock_.phase_rad() - middle), -0.5 * kPi, 0.5 * kPi);
  const double phase = std::min(middle + off, std::nextafter(kTurn, 0.0));
  if (std::abs(phase - state_.phase_rad) > kJump_rad) fade_begins_ = true;
  state_.phase_rad = phase;
  state_.phase_rate_rad_s = clock_.rate_rad_s();
}

/// The mixture's parameters now: eq. 3.23 around the boundaries of actions.
void BipedDrawerSequence::mix() {
  const double window = options_.beta * kPi, phase = state_.phase_rad;
  settle(current_, wanted_, 1.0 - std::exp(-options_.dt_s / options_.settle_s));
  if (state_.action != kStanding && !halted_ && !has_next_ && phase > kTurn - window) {
    next_ = following();
    has_next_ = true;
  }
  if (has_next_) {
    transition(current_, next_, 1, phase - kTurn, options_.beta, mixed_);
  } else if (has_previous_ && phase < window) {
    transition(previous_, current_, 1, phase, options_.beta, mixed_);
  } else {
    has_previous_ = false;
    mixed_ = current_;
  }
}

void BipedDrawerSequence::move_upper_body() {
  mix();
  const LearnedActions& learned = drawer_->actions;
  learned.at(mixed_, state_.phase_rad, rows_);
  move_grippers();
  const Eigen::Index joints = state_.q.size();
  if (fade_begins_) {
    fade_begins_ = false;
    offset_ = aim_ - rows_.head(joints);
    // of the joints, not of their aims: learned rows ripple where actions meet, at several rad/s
    // for some hundredths of a second, and a rate that is taken there would swing the arms for
    // kFade_s
    offset_rate_.setZero();
    if (!has_previous_) {  // else the transition goes on as it was
      const double ahead = kAhead_s * state_.phase_rate_rad_s;
      const double soon = std::min(state_.phase_rad + ahead, std::nextafter(kTurn, 0.0));
      learned.at(mixed_, soon, soon_);
      for (const Hand& hand : hand_) {
        if (hand.gripper >= 0) soon_[hand.gripper] = rows_[hand.gripper];
      }
      offset_rate_ = state_.dq - (soon_ - rows_).head(joints) / kAhead_s;
    }
    fade_s_ = 0.0;
  }
  fade_s_ = std::min(fade_s_ + options_.dt_s, kFade_s);
  // q̈ = λ²(u − q) − 2λq̇, exactly for a constant u
  const double dt = options_.dt_s, decay = std::exp(-kLambda_1_s * dt);
  for (Eigen::Index i = 0; i < joints; ++i) {
    const double u = std::clamp(rows_[i] + faded(offset_[i], offset_rate_[i], fade_s_, kFade_s),
                                lower_[i], upper_[i]);
    aim_[i] = u;
    const double e = state_.q[i] - u, a = state_.dq[i] + kLambda_1_s * e;
    const double next = (e + dt * a) * decay;
    state_.dq[i] = a * decay - kLambda_1_s * next;
    state_.q[i] = u + next;
  }
}

void BipedDrawerSequence::wish_velocity() {
  Eigen::Vector3d wished = rows_.tail<3>();
  if (state_.action == kStanding || halted_ || !robot_.moves() ||
      robot_.gait == RobotGait::starting) {
    wished.setZero();
  } else if (from_stand_ && state_.phase_rad < kPi) {
    wished *= 0.5 * (1.0 - std::cos(state_.phase_rad));
  }
  const double most = kAcceleration_m_s2 * options_.dt_s;
  for (const int i : {0, 1, 2}) {
    state_.velocity[i] += std::clamp(wished[i] - state_.velocity[i], -most, most);
  }
}

}  // namespace mimesis::synthesizer
