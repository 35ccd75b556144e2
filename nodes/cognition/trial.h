#pragma once
#include <array>
#include <functional>
#include <string_view>
#include <vector>

#include "nodes/cognition/imitator.h"
#include "nodes/cognition/ladder.h"

namespace mimesis::cognition {

/// What reaches the fields after the onset of a demonstration, for vision.window_s.
struct LaterInput {
  double at_s;              ///< from the onset of the demonstration [s]
  Demonstration shown{};    ///< parts that vision sees only now
  Demonstration planned{};  ///< means for which the planner found a motion
};

/// One run of the ladder from rest: task input alone, then a demonstration, then relaxation.
struct Trial {
  Demonstration shown{};
  TaskInput task{};         ///< constant input
  double preshape_s = 1.0;  ///< task input before the demonstration [s]
  double duration_s = 2.0;  ///< from the onset of the demonstration [s]
  std::vector<LaterInput> later{};
};

/// Events of a trial; times from the onset of the demonstration.
struct TrialResult {
  std::array<double, kLayers> onset_s{};  ///< first u > 0 of each field; NaN if never [s]
  std::array<Peaks, kLayers> peaks;       ///< at the end
  Decision decision;                      ///< at the end

  double onset(Layer layer) const { return onset_s[index(layer)]; }
  int site(Layer layer) const { return peaks[index(layer)].site; }
};

/// Runs one trial; links stay as they are. `observe(t_s)` is called after every step.
template <class Real>
TrialResult run_trial(Ladder<Real>& ladder, const Trial& trial,
                      const std::function<void(double)>& observe = {});

/// "grip,transport,goal" or "grip,transport,goal,color", as in launch files
/// ("precision,above,high").
/// @throws ConfigError that names the word and the choices.
Demonstration parse_sequence(std::string_view text);

/// Practises one sequence in the familiar task: shows it, waits for the stable state, rewards it
/// for the learning window [M18 eq. 2.3]. False, and nothing learned, if the robot settled on
/// something else.
template <class Real>
bool rehearse(Ladder<Real>& ladder, const Demonstration& sequence);

extern template TrialResult run_trial(Ladder<float>&, const Trial&,
                                      const std::function<void(double)>&);
extern template TrialResult run_trial(Ladder<double>&, const Trial&,
                                      const std::function<void(double)>&);
extern template bool rehearse(Ladder<float>&, const Demonstration&);
extern template bool rehearse(Ladder<double>&, const Demonstration&);

}  // namespace mimesis::cognition
