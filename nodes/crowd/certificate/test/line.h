#pragma once
#include <algorithm>
#include <random>
#include <vector>

#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/rules/rules.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

inline constexpr double kOmega = 5.0, kDt = 2e-3;
inline constexpr double kSine[] = {0.0, 0.08};  // g = .2 + .08 sin 2φ, beta = .12/.28

inline GaitRange gait() { return {SpeedFunction(0.2, {}, kSine), kOmega, 0.0}; }

/// A crowd on a line, by Euler steps of the printed equations 4.28-4.31: nothing of the engine.
struct Line {
  Line(const Rules& r, int n, unsigned seed)
      : rules(r),
        frequency(coupling(r.frequency.graph, n)),
        length(coupling(r.length.graph, n)),
        phase(coupling(r.phase.graph, n)) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    for (int i = 0; i < n; ++i) {
      phi.push_back(spread_rad * uniform(random));
      z.push_back(spread_m * uniform(random));
    }
    d.assign(phi.size(), 0.0);
    error.assign(phi.size(), 0.0);
    filtered = rate = longer = error;
  }

  void step() {
    std::ranges::fill(rate, kOmega);
    std::ranges::fill(longer, 0.0);
    if (rules.frequency.gain_rad_m_s != 0.0) {
      spacing_errors(frequency, z, d, error);
      for (std::size_t i = 0; i < phi.size(); ++i) {
        const double alpha = rules.frequency.low_pass_rad_s;
        if (alpha > 0.0) filtered[i] += kDt * alpha * (error[i] - filtered[i]);
        const double kept =
            saturate(alpha > 0.0 ? filtered[i] : error[i], rules.frequency.saturation_m);
        rate[i] += frequency_change(rules.frequency.gain_rad_m_s, kept);
      }
    }
    if (rules.length.gain_1_m != 0.0) {
      spacing_errors(length, z, d, error);
      for (std::size_t i = 0; i < phi.size(); ++i) {
        longer[i] = step_length_change(rules.length.gain_1_m, rules.length.limit, error[i]);
      }
    }
    if (rules.phase.gain_1_s != 0.0) {
      add_phase_coupling(phase, rules.phase.gain_1_s, phi, {}, rate);
    }
    for (std::size_t i = 0; i < phi.size(); ++i) {
      z[i] += (1.0 + longer[i]) * (g.integral(phi[i] + kDt * rate[i]) - g.integral(phi[i]));
      phi[i] += kDt * rate[i];
    }
    t += kDt;
  }

  /// How far the group is from its formation: max − min of z − d.
  double apart() const {
    double least = z[0] - d[0], most = least;
    for (std::size_t i = 1; i < z.size(); ++i) {
      least = std::min(least, z[i] - d[i]);
      most = std::max(most, z[i] - d[i]);
    }
    return most - least;
  }
  double phases_apart() const {
    const auto [least, most] = std::ranges::minmax(phi);
    return most - least;
  }

  Rules rules;
  CouplingGraph frequency, length, phase;
  double spread_rad = 1.0, spread_m = 0.6, t = 0.0;
  SpeedFunction g = gait().gait;
  std::vector<double> phi, z, d, error, filtered, rate, longer;
};

}  // namespace mimesis::crowd
