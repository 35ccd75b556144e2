#include "nodes/walker/pattern/mpc_pattern.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "nodes/walker/pattern/cart_table.h"

namespace mimesis::walker {
namespace {

constexpr double kLandingMet_m = 1e-3, kYawMet_rad = 1e-3;
// The plan ends 1.6 s ahead with a CoM that one more step can catch: so long before its end that
// two steps are left, another hand must brake.
constexpr int kPatienceTicks = 40;

}  // namespace

MpcPattern::MpcPattern(const GaitSettings& settings, bool yaw_free, const MpcWeights& weights)
    : settings_((check(settings), settings)),
      yaw_free_(yaw_free),
      footsteps_(settings),
      steps_(settings, Steps::Change::kAtOnce),
      standing_(settings.com_height_m),
      mpc_(settings, yaw_free, weights),
      qp_(mpc_.variables(), mpc_.most_rows()),
      stopper_(settings) {
  const auto n = static_cast<std::size_t>(mpc_.samples());
  jerk_.resize(n);
  node_.resize(n + 1);
  input_.zmp_plan_W_m.resize(n);
  trouble_.reason.reserve(160);
  reset(steps_.ground());
}

void MpcPattern::reset(const std::array<Footprint, 2>& feet) {
  steps_.reset(feet);
  com_ = {.p_W_m = steps_.middle_W_m()};
  std::fill(jerk_.begin(), jerk_.end(), Eigen::Vector2d::Zero());
  first_ticks_ = kSampleTicks;
  last_jerk_.setZero();
  failed_ticks_ = 0;
  gave_up_ = false;
  qp_.forget();
  problem_.reset();
  trouble_.failed_solves = 0;
  trouble_.reason.clear();
  trouble_.clipped = false;
  predict();
  sample_ = ahead(0);
}

void MpcPattern::step(const Wish& wish) {
  trouble_.clipped = false;
  if (gave_up_) return stop_without_programs();
  trouble_.reason.clear();
  const FeasibleWish feasible = footsteps_.feasible(wish, trouble_);
  const Steps before = steps_;
  steps_.decide(feasible.walk, first_swing(feasible), Standing::settled(com_, steps_.middle_W_m()));
  if (steps_.phase() != Steps::Phase::kStand && !plan(feasible, true)) {
    // Too late to stop, to go on or to turn the feet so: this tick goes on as planned.
    steps_ = before;
    FeasibleWish unchanged;
    unchanged.walk = !before.stopping();
    if (before.phase() != Steps::Phase::kStand && plan(unchanged, false)) trouble_.reason.clear();
  }
  const bool walks = steps_.phase() != Steps::Phase::kStand;
  failed_ticks_ = walks && trouble_.failed_solves > 0 ? failed_ticks_ + 1 : 0;
  if (failed_ticks_ > kPatienceTicks) {
    gave_up_ = true;
    stopper_.take_over(steps_, com_, last_jerk_);
    trouble_.reason += " no more: stops";
    return stop_without_programs();
  }
  advance_tick();
  sample_ = ahead(0);
}

void MpcPattern::stop_without_programs() {
  Wish stop;
  stop.walk = false;
  stopper_.step(stop);
  sample_ = stopper_.now();
  if (sample_.gait != Gait::kStanding) return;
  gave_up_ = false;
  steps_ = stopper_.steps();
  com_ = sample_.com;
  last_jerk_.setZero();
  std::fill(jerk_.begin(), jerk_.end(), Eigen::Vector2d::Zero());
  failed_ticks_ = trouble_.failed_solves = 0;
  trouble_.reason.clear();
  first_ticks_ = kSampleTicks;
  qp_.forget();
  predict();
}

bool MpcPattern::plan(const FeasibleWish& wish, bool turn_feet) {
  place_feet(wish, turn_feet);
  input_.com = com_;
  input_.yaw_rad = steps_.yaw_rad();
  input_.wish = wish;
  const int r = steps_.ticks_to_sample();
  if (yaw_free_)
    for (int k = 0; k < mpc_.samples(); ++k)
      input_.zmp_plan_W_m[static_cast<std::size_t>(k)] =
          zmp(com_after(r + k * kSampleTicks), settings_.com_height_m);
  problem_.emplace(mpc_.build(input_, steps_));
  const qp::Outcome outcome = qp_.solve(*problem_);
  if (outcome == qp::Outcome::kSolved && qp_.x().allFinite()) {
    trouble_.failed_solves = 0;
    take_solution(wish);
    return true;
  }
  ++trouble_.failed_solves;
  trouble_.reason = "walking pattern: quadratic program ";
  trouble_.reason += qp::name(outcome);
  trouble_.reason += "; the last plan goes on";
  return false;
}

void MpcPattern::place_feet(const FeasibleWish& wish, bool turn_feet) {
  const int left = steps_.landings_left();
  double yaw_before = steps_.stance().yaw_rad;
  Side swing = steps_.swing();
  for (int i = 0; i < 2; ++i) {
    MpcInput::Foot& foot = input_.foot[static_cast<std::size_t>(i)];
    const std::optional<Footprint>& landing = wish.landing[static_cast<std::size_t>(i)];
    const bool last = left >= 0 && i >= left - 1;
    const bool wished = landing && landing->side == swing && (left < 0 || i < left);
    foot.plan = steps_.landing(i);
    foot.wished_yaw_rad = footsteps_.reachable_yaw(
        yaw_before, wished ? landing->yaw_rad
                           : yaw_before + (last ? 0.0 : wish.yaw_rate_rad_s * settings_.step_s));
    foot.p_W_m.reset();
    foot.step_W_m = footsteps_.step_W_m(swing, yaw_before, foot.wished_yaw_rad,
                                        last ? Eigen::Vector2d::Zero() : wish.velocity_m_s);
    if (wished)
      foot.p_W_m = landing->p_W_m;
    else if (last && i == 0)
      foot.p_W_m = steps_.stance().p_W_m + foot.step_W_m;
    if (!yaw_free_) {
      const double most = !turn_feet ? 0.0 : i == 0 ? mpc_.yaw_freedom_rad(steps_) : 1e3;
      foot.plan.yaw_rad += std::clamp(foot.wished_yaw_rad - foot.plan.yaw_rad, -most, most);
    }
    yaw_before = yaw_free_ ? foot.wished_yaw_rad : foot.plan.yaw_rad;
    swing = robot::other(swing);
  }
}

void MpcPattern::take_solution(const FeasibleWish& wish) {
  const auto x = qp_.x();
  for (int k = 0; k < mpc_.samples(); ++k) jerk_[static_cast<std::size_t>(k)] = mpc_.jerk(x, k);
  first_ticks_ = steps_.ticks_to_sample();
  for (int i = 0; i < 2; ++i) {
    const MpcInput::Foot& foot = input_.foot[static_cast<std::size_t>(i)];
    steps_.plan(i,
                {kLeft, mpc_.landing_W_m(x, i), foot.plan.yaw_rad + mpc_.yaw_increment_rad(x, i)});
  }
  steps_.plan(2, footsteps_.next(steps_.landing(1), wish));
  const std::optional<Footprint>& wished = wish.landing[0];
  if (!wished || steps_.landings_left() == 0) return;
  const Footprint& landing = steps_.landing(0);
  trouble_.clipped = trouble_.clipped || wished->side != landing.side ||
                     (wished->p_W_m - landing.p_W_m).norm() > kLandingMet_m ||
                     std::abs(math::wrap_pi(wished->yaw_rad - landing.yaw_rad)) > kYawMet_rad;
}

void MpcPattern::advance_tick() {
  if (steps_.phase() == Steps::Phase::kStand) {
    com_ = standing_.after(com_, steps_.middle_W_m(), 1);
    last_jerk_.setZero();
  } else {
    last_jerk_ = jerk_[0];
    com_ = advance(com_, last_jerk_, kTick_s);
    if (--first_ticks_ == 0) {
      std::rotate(jerk_.begin(), jerk_.begin() + 1, jerk_.end());
      jerk_.back().setZero();
      first_ticks_ = kSampleTicks;
    }
  }
  steps_.advance(1);
  predict();
}

void MpcPattern::predict() {
  node_[0] = com_;
  double interval_s = first_ticks_ * kTick_s;
  for (std::size_t k = 0; k < jerk_.size(); ++k) {
    node_[k + 1] = walker::advance(node_[k], jerk_[k], interval_s);
    interval_s = kSampleTicks * kTick_s;
  }
}

ComState MpcPattern::com_after(int ticks) const {
  if (steps_.phase() == Steps::Phase::kStand)
    return standing_.after(com_, steps_.middle_W_m(), ticks);
  if (ticks <= first_ticks_) return advance(com_, jerk_[0], ticks * kTick_s);
  ticks -= first_ticks_;
  const auto k = 1 + static_cast<std::size_t>(ticks / kSampleTicks);
  if (k < jerk_.size()) return advance(node_[k], jerk_[k], ticks % kSampleTicks * kTick_s);
  return with_zmp_at_rest(node_.back(), settings_.com_height_m,
                          (ticks - static_cast<int>(jerk_.size() - 1) * kSampleTicks) * kTick_s);
}

PatternSample MpcPattern::ahead(int ticks_ahead) const {
  if (gave_up_) return stopper_.ahead(ticks_ahead);
  Steps steps = steps_;
  steps.advance(ticks_ahead);
  PatternSample sample;
  steps.describe(sample);
  sample.com = com_after(ticks_ahead);
  sample.zmp_W_m = zmp(sample.com, settings_.com_height_m);
  sample.left_share = left_share(sample);
  return sample;
}

void MpcPattern::shift(const Eigen::Vector2d& shift_W_m) {
  if (gave_up_) stopper_.shift(shift_W_m);
  com_.p_W_m += shift_W_m;
  steps_.shift(shift_W_m);
  predict();
  sample_ = ahead(0);
}

}  // namespace mimesis::walker
