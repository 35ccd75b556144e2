#pragma once
#include <algorithm>

#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// How much legs give way under load: a leg that bears F is δ = c F shorter than its set-points.
/// c by least squares over the last seconds, Σ F δ / Σ F², from encoders that see the springs;
/// 0 for stiff joints, and for encoders on the motors' side.
class LegGive {
 public:
  void reset() { load_ = shortening_ = 0.0; }
  /// Once a tick for each leg.
  void measure(double normal_n, double shorter_m) {
    constexpr double kForget = kTick_s / 2.0;  // seconds
    load_ += kForget * (normal_n * normal_n - load_);
    shortening_ += kForget * (normal_n * shorter_m - shortening_);
  }
  /// c; `least_n`: below, there was no load to learn from.
  double m_n(double least_n) const {
    constexpr double kMost_m_n = 1e-5;
    return load_ < least_n * least_n ? 0.0 : std::clamp(shortening_ / load_, 0.0, kMost_m_n);
  }

 private:
  double load_ = 0.0, shortening_ = 0.0;
};

}  // namespace mimesis::walker
