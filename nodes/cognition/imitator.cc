#include "nodes/cognition/imitator.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "nodes/cognition/trial.h"

namespace mimesis::cognition {

template <class Real>
Peaks read_peaks(const Ladder<Real>& ladder, Layer layer) {
  const auto u = ladder.field(layer).activity();
  Peaks peaks;
  bool inside = false;
  std::size_t top = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    if (u[i] > 0 && !inside) ++peaks.count;
    inside = u[i] > 0;
    if (u[i] > u[top]) top = i;
  }
  peaks.max_u = static_cast<double>(u[top]);
  if (peaks.count > 0) {
    peaks.site = std::min(static_cast<int>(top * static_cast<std::size_t>(sites(layer)) / u.size()),
                          sites(layer) - 1);
  }
  return peaks;
}

template <class Real>
Decision read_decision(const Ladder<Real>& ladder) {
  constexpr double kAtRest_1_s = 1.0;
  const auto symbol = [&](Layer layer) {
    const Peaks peaks = read_peaks(ladder, layer);
    return peaks.count == 1 ? peaks.site + 1 : 0;
  };
  Decision d{static_cast<Grip>(symbol(Layer::f5_grip)),
             static_cast<Transport>(symbol(Layer::f5_transport)),
             static_cast<Goal>(symbol(Layer::pfc)), static_cast<Color>(symbol(Layer::color))};
  d.settled =
      d.grip != Grip::unknown && d.transport != Transport::unknown && d.goal != Goal::unknown;
  for (const Layer layer : kAllLayers) {
    d.settled = d.settled && ladder.field(layer).speed_1_s() < kAtRest_1_s;
  }
  return d;
}

template Peaks read_peaks(const Ladder<float>&, Layer);
template Peaks read_peaks(const Ladder<double>&, Layer);
template Decision read_decision(const Ladder<float>&);
template Decision read_decision(const Ladder<double>&);

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
