#include "nodes/walker/filter/dynamic_filter.h"

#include <cmath>
#include <string>

#include "common/error.h"

namespace mimesis::walker {
namespace {

ComState operator+(const ComState& a, const ComState& b) {
  return {.p_W_m = a.p_W_m + b.p_W_m, .v_W = a.v_W + b.v_W, .a_W = a.a_W + b.a_W};
}

const FilterSettings& checked(const FilterSettings& s) {
  const auto refuse = [](const std::string& what) { throw ConfigError("dynamic filter: " + what); };
  if (s.samples < 2 || s.samples > kPreviewTicks) {
    refuse("samples " + std::to_string(s.samples) + ", expected 2 to 320");
  }
  if (!(s.window_s >= s.samples * kTick_s) || !(s.window_s < kPreviewTicks * kTick_s)) {
    refuse("window_s " + std::to_string(s.window_s) +
           ", expected at least a tick a sample and below 1.6");
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
      body_(biped, gait.com_height_m),
      correction_(gait.com_height_m, settings.samples, ticks_a_sample_),
      rest_(at_rest(biped)),
      rest_moments_(body_.moments(rest_)),
      state_(static_cast<std::size_t>(settings.iterations), State::Zero()),
      plan_(static_cast<std::size_t>(settings.samples)),
      com_(plan_.size()),
      moments_(plan_.size()),
      lever_(plan_.size() * state_.size() + 2),
      wanted_(Correction::Errors::Zero(settings.samples, 2)) {}

void DynamicFilter::reset() {
  for (State& state : state_) state.setZero();
  for (WholeBody::Lever& lever : lever_) lever.known = false;
  error_before_.setZero();
  error_after_.setZero();
  unreachable_ = 0;
}

Eigen::Vector2d DynamicFilter::error(const PatternSample& sample, const ComState& com,
                                     const UpperBody& upper, const WholeBody::Moments& moments,
                                     WholeBody::Lever& lever) {
  const Eigen::Vector2d zmp = body_.zmp(sample, com, upper, moments, &lever);
  if (body_.unreachable()) ++unreachable_;
  return zmp - sample.zmp_W_m;
}

ComState DynamicFilter::step(const PatternGenerator& pattern, std::span<const UpperBody> upper) {
  MIMESIS_ASSERT(upper.size() == 1 || upper.size() >= plan_.size());
  const auto upper_at = [&](std::size_t k) -> const UpperBody& {
    return settings_.legs_only ? rest_ : upper[upper.size() == 1 ? 0 : k];
  };
  unreachable_ = 0;
  for (std::size_t k = 0; k < plan_.size(); ++k) {
    plan_[k] = pattern.ahead(static_cast<int>(k) * ticks_a_sample_);
    com_[k] = plan_[k].com;
    if (settings_.legs_only) {
      moments_[k] = rest_moments_;
    } else {
      moments_[k] = k > 0 && upper.size() == 1 ? moments_[0] : body_.moments(upper_at(k));
    }
  }
  ComState shift;
  auto lever = lever_.begin();
  for (State& state : state_) {
    for (std::size_t k = 0; k < plan_.size(); ++k) {
      wanted_.row(static_cast<Eigen::Index>(k)) =
          -error(plan_[k], com_[k], upper_at(k), moments_[k], *lever++).transpose();
    }
    if (&state == &state_.front()) error_before_ = -wanted_.row(0).transpose();
    for (std::size_t k = 0; k < plan_.size(); ++k) {
      com_[k] = com_[k] + correction_.at(static_cast<int>(k), state, wanted_);
    }
    shift = shift + to_com(state);
    state = correction_.next(state, wanted_);
  }
  const WholeBody::Moments truth = settings_.legs_only ? body_.moments(upper[0]) : moments_[0];
  if (settings_.legs_only) error_before_ = error(plan_[0], plan_[0].com, upper[0], truth, *lever++);
  error_after_ = error(plan_[0], plan_[0].com + shift, upper[0], truth, lever_.back());
  return shift;
}

}  // namespace mimesis::walker
