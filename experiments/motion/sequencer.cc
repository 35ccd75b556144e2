#include "experiments/motion/sequencer.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::synthesizer {

Sequencer::Sequencer(MotionParameters first, int fixed, double phase_rad, double beta)
    : fixed_(fixed),
      beta_(beta),
      last_rad_(phase_rad),
      in_action_rad_(math::wrap_two_pi(phase_rad)),
      previous_(first),
      current_(first),
      next_(first),
      out_(std::move(first)) {
  if (!(beta > 0.0 && beta <= 1.0)) {
    throw ConfigError("transition: beta is " + std::to_string(beta) + ", expected one in (0, 1]");
  }
  if (fixed < 0 || fixed > current_.weight_rad.cols()) {
    throw ConfigError("transition: " + std::to_string(fixed) + " non-periodic sources of " +
                      std::to_string(current_.weight_rad.cols()));
  }
}

void Sequencer::use_least_jerk(const motion::MotionModel& model) {
  LeastJerkTransition found(model, beta_);
  if (static_cast<Eigen::Index>(model.rows.size()) != current_.mean_rad.size() ||
      model.sources.rows() != current_.weight_rad.cols()) {
    throw ConfigError("transition: model '" + model.name + "' has " +
                      std::to_string(model.rows.size()) + " rows and " +
                      std::to_string(model.sources.rows()) + " sources, expected " +
                      std::to_string(current_.mean_rad.size()) + " and " +
                      std::to_string(current_.weight_rad.cols()));
  }
  least_jerk_.emplace(std::move(found));
  prepared_ = false;
}

void Sequencer::blend(const MotionParameters& from, const MotionParameters& to, double phase) {
  if (!least_jerk_) return transition(from, to, fixed_, phase, beta_, out_);
  if (!prepared_) least_jerk_->prepare(from, to);
  prepared_ = true;
  least_jerk_->at(phase, out_);
}

bool Sequencer::announce(const MotionParameters& next) {
  MIMESIS_ASSERT(next.weight_rad.rows() == current_.weight_rad.rows() &&
                 next.weight_rad.cols() == current_.weight_rad.cols());
  if (in_action_rad_ > math::kTwoPi - beta_ * std::numbers::pi) return false;
  next_ = next;
  announced_ = true;
  return true;
}

void Sequencer::cross() {
  in_action_rad_ -= math::kTwoPi;
  blending_in_ = announced_;
  if (!announced_) return;
  std::swap(previous_, current_);
  std::swap(current_, next_);
  announced_ = false;
  ++transitions_;
}

bool Sequencer::in_transition() const {
  const double half_width = beta_ * std::numbers::pi;
  return (blending_in_ && in_action_rad_ < half_width) ||
         (announced_ && in_action_rad_ > math::kTwoPi - half_width);
}

const MotionParameters& Sequencer::at(double phase_rad) {
  in_action_rad_ += math::wrap_pi(phase_rad - last_rad_);
  last_rad_ = phase_rad;
  if (in_action_rad_ >= math::kTwoPi) cross();
  if (blending_in_ && in_action_rad_ >= beta_ * std::numbers::pi) {
    blending_in_ = prepared_ = false;  // with β = 1 the next one may begin at once
  }
  // a step back over the crossing (a disturbed oscillator) stays with the blend at the crossing
  const double phase = std::max(in_action_rad_, 0.0);
  if (blending_in_) {
    blend(previous_, current_, phase);
  } else if (announced_ && phase > math::kTwoPi - beta_ * std::numbers::pi) {
    blend(current_, next_, phase - math::kTwoPi);
  } else {
    prepared_ = false;
    return current_;
  }
  return out_;
}

}  // namespace mimesis::synthesizer
