#include "nodes/walker/pattern/generators.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::walker {
namespace {

constexpr int kCrossingTicks = kSampleTicks;  // time in which the ZMP crosses from foot to foot
// Length of the reference: predictions for the end of the preview look as far ahead as today's.
constexpr int kWindowTicks = 2 * kPreviewTicks;

constexpr double kLandingMet_m = 1e-3, kYawMet_rad = 1e-3;
// The plan ends 1.6 s ahead with a CoM that one more step can catch. The stopper must take over
// while two steps of the plan are left.
constexpr int kPatienceTicks = 40;

PatternSample sample_of(Steps steps, int ticks_ahead, const ComState& com, double com_height_m) {
  steps.advance(ticks_ahead);
  PatternSample sample;
  steps.describe(sample);
  sample.com = com;
  sample.zmp_W_m = zmp(com, com_height_m);
  sample.left_share = left_share(sample);
  return sample;
}

}  // namespace

PreviewPattern::PreviewPattern(const GaitSettings& settings)
    : settings_((check(settings), settings)),
      footsteps_(settings),
      steps_(settings, Steps::Change::after_landing),
      control_({.height_m = settings.com_height_m, .samples = kWindowTicks, .jerk_weight = 1e-6}),
      centre_(kCrossingTicks + kWindowTicks),
      reference_(kWindowTicks),
      coms_(kPreviewTicks + 1) {
  trouble_.reason.reserve(160);
  reset(steps_.ground());
}

void PreviewPattern::reset(const std::array<Footprint, 2>& feet) {
  steps_.reset(feet);
  std::fill(centre_.begin(), centre_.end(), steps_.middle_W_m());
  control_.reset({.p_W_m = steps_.middle_W_m()});
  trouble_.failed_solves = 0;
  trouble_.reason.clear();
  trouble_.clipped = false;
  refer();
  sample_ = ahead(0);
}

void PreviewPattern::take_over(const Steps& steps, const ComState& com,
                               const Eigen::Vector2d& last_jerk) {
  steps_ = steps;
  control_.reset(com, last_jerk);
  // the reference crosses from the ZMP as it is to the feet
  std::fill(centre_.begin(), centre_.end(), control_.zmp_W_m());
  refer();
  sample_ = ahead(0);
}

void PreviewPattern::step(const Wish& wish) {
  trouble_.clipped = false;
  trouble_.reason.clear();
  const FeasibleWish feasible = footsteps_.feasible(wish, trouble_);
  steps_.decide(feasible.walk, first_swing(feasible),
                Standing::settled(control_.com(), steps_.middle_W_m()));
  place_feet(feasible);
  refer();
  control_.step(reference_);
  std::rotate(centre_.begin(), centre_.begin() + 1, centre_.begin() + kCrossingTicks + 1);
  steps_.advance(1);
  sample_ = ahead(0);
}

void PreviewPattern::place_feet(const FeasibleWish& wish) {
  const bool stepping = steps_.phase() == Steps::Phase::step;
  if (!stepping && steps_.phase() != Steps::Phase::start) return;
  const int left = steps_.landings_left();
  Footprint stance = steps_.stance();
  for (int i = 0; i < 3; ++i) {
    const bool last = left >= 0 && i >= left - 1;
    Footprint next = last ? footsteps_.beside(stance)
                          : footsteps_.reachable(stance, footsteps_.next(stance, wish));
    if (i < 2 && wish.landing[static_cast<std::size_t>(i)] && (left < 0 || i < left)) {
      const Footprint& wished = *wish.landing[static_cast<std::size_t>(i)];
      if (wished.side == next.side) next = footsteps_.reachable(stance, wished);
      trouble_.clipped = trouble_.clipped || (next.p_W_m - wished.p_W_m).norm() > 1e-3;
    }
    if (i > 0 || !stepping || steps_.tick() == 0) steps_.plan(i, next);
    stance = steps_.landing(i);
  }
}

Eigen::Vector2d PreviewPattern::centre_after(int ticks) const {
  const Support support = steps_.support_after(ticks);
  if (support.both) return steps_.middle_W_m();
  const auto foot = [&](int i) {
    return i == 0 ? steps_.stance().p_W_m : steps_.landing(i - 1).p_W_m;
  };
  return (foot(support.i) + foot(support.j)) / 2.0;
}

void PreviewPattern::refer() {
  // the mean over the last ticks makes every change of support a straight crossing
  for (int i = 0; i < kWindowTicks; ++i)
    centre_[static_cast<std::size_t>(kCrossingTicks + i)] = centre_after(i);
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int i = 1; i < kCrossingTicks; ++i) sum += centre_[static_cast<std::size_t>(i)];
  for (std::size_t i = 0; i < reference_.size(); ++i) {
    sum += centre_[i + kCrossingTicks];
    reference_[i] = sum / kCrossingTicks;
    sum -= centre_[i + 1];
  }
  control_.roll_out(std::span(reference_), coms_);
}

PatternSample PreviewPattern::ahead(int ticks_ahead) const {
  return sample_of(
      steps_, ticks_ahead,
      ticks_ahead == 0 ? control_.com() : coms_[static_cast<std::size_t>(ticks_ahead) + 1],
      settings_.com_height_m);
}

void PreviewPattern::shift(const Eigen::Vector2d& shift_W_m) {
  for (Eigen::Vector2d& centre : centre_) centre += shift_W_m;
  for (ComState& com : coms_) com.p_W_m += shift_W_m;
  control_.shift(shift_W_m);
  steps_.shift(shift_W_m);
  sample_ = ahead(0);
}

MpcPattern::MpcPattern(const GaitSettings& settings, bool yaw_free, const MpcWeights& weights)
    : settings_((check(settings), settings)),
      yaw_free_(yaw_free),
      footsteps_(settings),
      steps_(settings, Steps::Change::at_once),
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
  if (steps_.phase() != Steps::Phase::stand && !plan(feasible, true)) {
    // Too late to stop, to continue or to turn the feet so: this tick follows the plan.
    steps_ = before;
    FeasibleWish unchanged;
    unchanged.walk = !before.stopping();
    if (before.phase() != Steps::Phase::stand && plan(unchanged, false)) trouble_.reason.clear();
  }
  const bool walks = steps_.phase() != Steps::Phase::stand;
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
  if (sample_.gait != Gait::standing) return;
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
  if (outcome == qp::Outcome::solved && qp_.x().allFinite()) {
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
    MpcInput::Landing& foot = input_.foot[static_cast<std::size_t>(i)];
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
    const MpcInput::Landing& foot = input_.foot[static_cast<std::size_t>(i)];
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
  if (steps_.phase() == Steps::Phase::stand) {
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
  if (steps_.phase() == Steps::Phase::stand)
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
  return sample_of(steps_, ticks_ahead, com_after(ticks_ahead), settings_.com_height_m);
}

void MpcPattern::shift(const Eigen::Vector2d& shift_W_m) {
  if (gave_up_) stopper_.shift(shift_W_m);
  com_.p_W_m += shift_W_m;
  steps_.shift(shift_W_m);
  predict();
  sample_ = ahead(0);
}

}  // namespace mimesis::walker
