#pragma once
#include <limits>
#include <vector>

#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// From `at_s` on the group has these rules; the last stage is the one that is certified.
struct RuleStage {
  double at_s = 0.0;
  Rules rules{};
};

/// A crowd of the engine that orders itself [M18 4.4.2, 4].
struct FormationRun {
  Group group{};
  Gait gait{};
  std::vector<RuleStage> stages{};
  double until_s = 60.0;
  int seed = 1;
};

/// Agents at one time, places along the path relative to their mean.
struct Snapshot {
  double time_s = 0.0;
  std::vector<double> z_m, lane_m, heading_rad, phase_rad;
};

struct FormationOutcome {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  struct Sample {
    double time_s, error_m, lane_error_m, dispersion;
  };
  std::vector<Sample> samples;         ///< every 0.05 s
  std::vector<Snapshot> snapshots;     ///< at the start, at each later stage, at the end
  double formed_s = kNone;             ///< from when on they were, none if not at the end
  double near_s = kNone;               ///< from when on the error along was below `kNear_m`
  double length_rate_1_s = kNone;      ///< measured decay of the formation error at the end
  double phase_rate_1_s = kNone;       ///< decay rate of the dispersion
  double expected_length_1_s = kNone;  ///< expected rate of the step lengths, from the certificate
  double expected_phase_1_s = kNone;
  double least_distance_m = kNone;  ///< between centres, while a stage avoids
  int overlapping = 0;              ///< agent-steps with overlap, while a stage avoids
};

inline constexpr double kFormed_m = 0.01, kNear_m = 0.1;

FormationOutcome run(const FormationRun& run);

}  // namespace mimesis::crowd
