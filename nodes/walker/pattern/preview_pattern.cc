#include "nodes/walker/pattern/preview_pattern.h"

#include <algorithm>
#include <cmath>

namespace mimesis::walker {
namespace {

constexpr int kCrossingTicks = kSampleTicks;  // of the ZMP from foot to foot
// Of the reference, so that what is ahead looks as far as what is now.
constexpr int kWindowTicks = 2 * kPreviewTicks;

}  // namespace

PreviewPattern::PreviewPattern(const GaitSettings& settings)
    : settings_((check(settings), settings)),
      footsteps_(settings),
      steps_(settings, Steps::Change::kAfterLanding),
      control_({.form = PreviewForm::kIntegral,
                .height_m = settings.com_height_m,
                .samples = kWindowTicks,
                .jerk_weight = 1e-6}),
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
  const bool stepping = steps_.phase() == Steps::Phase::kStep;
  if (!stepping && steps_.phase() != Steps::Phase::kStart) return;
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
  Steps steps = steps_;
  steps.advance(ticks_ahead);
  PatternSample sample;
  steps.describe(sample);
  sample.com = ticks_ahead == 0 ? control_.com() : coms_[static_cast<std::size_t>(ticks_ahead) + 1];
  sample.zmp_W_m = zmp(sample.com, settings_.com_height_m);
  sample.left_share = left_share(sample);
  return sample;
}

void PreviewPattern::shift(const Eigen::Vector2d& shift_W_m) {
  for (Eigen::Vector2d& centre : centre_) centre += shift_W_m;
  for (ComState& com : coms_) com.p_W_m += shift_W_m;
  control_.shift(shift_W_m);
  steps_.shift(shift_W_m);
  sample_ = ahead(0);
}

}  // namespace mimesis::walker
