#include "nodes/walker/filter/dynamic_filter.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/error.h"
#include "nodes/walker/pattern/cart_table.h"

namespace mimesis::walker {
namespace {

const FilterSettings& checked(const FilterSettings& s) {
  const auto refuse = [](const std::string& what) { throw ConfigError("dynamic filter: " + what); };
  if (s.samples < 2 || s.samples > kPreviewTicks) {
    refuse("samples " + std::to_string(s.samples) + ", expected 2 to " +
           std::to_string(kPreviewTicks));
  }
  if (!(s.window_s >= s.samples * kTick_s) || !(s.window_s < kPreviewTicks * kTick_s)) {
    refuse("window_s " + std::to_string(s.window_s) +
           ", expected at least a tick a sample and below " +
           std::to_string(kPreviewTicks * kTick_s));
  }
  if (s.iterations < 1 || s.iterations > 5) {
    refuse("iterations " + std::to_string(s.iterations) + ", expected 1 to 5");
  }
  return s;
}

UpperBody at_rest(const robot::Biped& biped) {
  const auto n = static_cast<Eigen::Index>(biped.upper_body.size());
  return {.q = biped.half_sitting(biped.upper_body),
          .dq = Eigen::VectorXd::Zero(n),
          .ddq = Eigen::VectorXd::Zero(n)};
}

}  // namespace

DynamicFilter::DynamicFilter(const robot::Biped& biped, const GaitSettings& gait,
                             const FilterSettings& settings)
    : settings_(checked(settings)),
      ticks_a_sample_(
          static_cast<int>(std::lround(settings.window_s / settings.samples / kTick_s))),
      com_height_(gait.com_height_m),
      body_(biped, gait.com_height_m),
      correction_(gait.com_height_m, settings.samples, ticks_a_sample_),
      rest_(at_rest(biped)),
      rest_moments_(body_.moments(rest_)),
      plan_(static_cast<std::size_t>(settings.samples)),
      shift_(plan_.size()),
      moments_(plan_.size()),
      lever_(plan_.size() * static_cast<std::size_t>(settings.iterations)) {
  for (Stage& stage : stage_) stage.wished.setZero(settings.samples, 2);
  reset();
}

void DynamicFilter::reset() {
  for (Stage& stage : stage_) stage.state.setZero();
  std::ranges::fill(shift_, ComState{});
  for (WholeBody::Lever& lever : lever_) lever.known = false;
  unreachable_ = 0;
}

const UpperBody& DynamicFilter::upper_at(std::size_t sample,
                                         std::span<const UpperBody> upper) const {
  return settings_.legs_only ? rest_ : upper[upper.size() == 1 ? 0 : sample];
}

void DynamicFilter::look_ahead(const PatternGenerator& pattern, std::span<const UpperBody> upper) {
  for (std::size_t k = 0; k < plan_.size(); ++k) {
    plan_[k] = pattern.ahead(static_cast<int>(k) * ticks_a_sample_);
    if (settings_.legs_only) {
      moments_[k] = rest_moments_;
    } else {
      moments_[k] = k > 0 && upper.size() == 1 ? moments_[0] : body_.moments(upper[k]);
    }
  }
}

ComState DynamicFilter::step(const PatternGenerator& pattern, std::span<const UpperBody> upper) {
  MIMESIS_ASSERT(upper.size() == 1 || upper.size() >= plan_.size());
  look_ahead(pattern, upper);
  unreachable_ = 0;
  auto lever = lever_.begin();
  for (int iteration = 0; iteration < settings_.iterations; ++iteration) {
    if (iteration > 0) forecast(&Correction::at);
    for (std::size_t k = 0; k < plan_.size(); ++k) {
      const PatternSample& plan = plan_[k];
      const Eigen::Vector2d real =
          body_.zmp(plan, plan.com + shift_[k], upper_at(k, upper), moments_[k], &*lever++);
      unreachable_ += body_.unreachable();
      // what the shift does as a cart-table is no error, but what is wished
      stage_[0].wished.row(static_cast<Eigen::Index>(k)) =
          (plan.zmp_W_m + zmp(shift_[k], com_height_) - real).transpose();
    }
    share_wish();
  }
  ComState shift;
  for (const Stage& stage : stage_) shift = shift + to_com(stage.state);
  forecast(&Correction::at_in_next_tick);
  for (Stage& stage : stage_) stage.state = correction_.next(stage.state, stage.wished);
  return shift;
}

/// A stage of preview control is wished what the one before it will leave.
void DynamicFilter::share_wish() {
  for (std::size_t i = 1; i < stage_.size(); ++i) {
    const Stage& last = stage_[i - 1];
    for (int k = 0; k < settings_.samples; ++k) {
      stage_[i].wished.row(k) =
          last.wished.row(k) -
          zmp(correction_.at(k, last.state, last.wished), com_height_).transpose();
    }
  }
}

/// Of the shift at all samples.
void DynamicFilter::forecast(Look look) {
  for (std::size_t k = 0; k < shift_.size(); ++k) {
    shift_[k] = {};
    for (const Stage& stage : stage_) {
      shift_[k] = shift_[k] + (correction_.*look)(static_cast<int>(k), stage.state, stage.wished);
    }
  }
}

}  // namespace mimesis::walker
