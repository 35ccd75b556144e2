#pragma once
#include <vector>

#include "nodes/crowd/rules/coupling_graph.h"

namespace mimesis::crowd {

/// Window of R for rates: below it rounding, above it the decay is not exponential.
inline constexpr double kLeastR = 1e-6, kMostR = 3e-2;

/// Networks of equal Andronov-Hopf oscillators that start at random phases of the limit cycle
/// [M18 4.3.6].
struct HopfTrials {
  Topology topology = Topology::all_to_all;
  int n = 3;
  double k_1_s = 1.0;
  int trials = 60;
  double until_s = 30.0;     ///< longest; a trial ends when R has left the window
  double dt_s = 0.02;        ///< step of RK4, smaller where the coupling is stiff
  double omega_rad_s = 6.0;  ///< angular frequency of every oscillator
  double sample_s = 0.1;     ///< between points of the mean curve
  bool curve = false;        ///< keep it; all trials then last `until_s`
};

struct HopfOutcome {
  std::vector<double> rate_1_s;    ///< rates of the trials that decayed
  int synchronised = 0;            ///< R < 1e-3 at some time
  std::vector<double> time_s;      ///< times of the curve
  std::vector<double> mean_log_r;  ///< mean over trials of ln R
  std::vector<double> mean_r;      ///< mean over trials of R, as M18 has it
};

/// λ⁺ of the closed forms that table 4.1 prints; none for wheels.
double printed_lambda(Topology topology, int n);
HopfOutcome run(const HopfTrials& trials);

}  // namespace mimesis::crowd
