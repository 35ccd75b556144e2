#include "nodes/cognition/imitator.h"

#include <cmath>

#include "common/error.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {
namespace {

bool same_symbols(const Demonstration& a, const Demonstration& b) {
  return a.grip == b.grip && a.transport == b.transport && a.goal == b.goal && a.color == b.color;
}

Demonstration practice_sequence(const std::string& text, std::size_t i) {
  try {
    return parse_sequence(text);
  } catch (const ConfigError& e) {
    throw ConfigError("cognition.practice[" + std::to_string(i) + "]: " + e.what());
  }
}

}  // namespace

Imitator::Imitator(const ImitatorParams& params)
    : params_(params), ladder_(params.ladder), task_(task_stimulus(params.ladder.task)) {
  for (std::size_t i = 0; i < params_.practice.size(); ++i) {
    const std::string& sequence = params_.practice[i];
    if (!rehearse(ladder_, practice_sequence(sequence, i))) refused_.push_back(sequence);
  }
}

void Imitator::observe(const Demonstration& seen, bool complete, double period_s) {
  if (!seen.anything()) {
    if (stage_ == Stage::waiting) return;
    ladder_.reset();
    stage_ = Stage::waiting;
    seen_ = {};
    decision_ = {};
    deciding_s_ = 0.0;
    window_left_ = reward_left_ = 0;
    return;
  }
  if (stage_ == Stage::deciding || stage_ == Stage::decided) return;
  stage_ = Stage::watching;
  unchanged_s_ = same_symbols(seen, seen_) ? unchanged_s_ + period_s : 0.0;
  seen_ = seen;
  if (!complete && unchanged_s_ < params_.patience_s) return;
  shown_ = task_;
  add_vision(params_.ladder.vision, seen_, shown_);
  window_left_ = std::lround(params_.ladder.vision.window_s / params_.ladder.dt_s);
  stage_ = Stage::deciding;
}

void Imitator::advance(double period_s, bool success) {
  learning_ = false;
  for (long i = std::lround(period_s / params_.ladder.dt_s); i > 0; --i) {
    const bool reward = decided() && success && reward_left_ > 0;
    ladder_.step(window_left_ > 0 ? shown_ : task_, reward);
    window_left_ -= window_left_ > 0 ? 1 : 0;
    reward_left_ -= reward ? 1 : 0;
    learning_ = learning_ || reward;
  }
  if (stage_ == Stage::deciding) {
    deciding_s_ += period_s;
    decision_ = read_decision(ladder_);
    decision_.settled =
        decision_.settled && window_left_ == 0;  // held by the fields, not by the input
    if (decision_.settled) {
      stage_ = Stage::decided;
      reward_left_ = std::lround(params_.ladder.learning.window_s / params_.ladder.dt_s);
    }
  }
}

}  // namespace mimesis::cognition
