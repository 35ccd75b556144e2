#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace mimesis::mocap {

/// Meaning and source of one trial (a gait cycle, or one action of a sequence).
struct Trial {
  std::string clip;   ///< file name
  std::string style;  ///< "happy", "slow", or an action's name; may be empty
  int cycle = 0;      ///< number within the clip
  long first_frame = 0, last_frame = 0;
  double duration_s = 0.0;
  double step_length_m = 0.0;  ///< travel of the pelvis along its heading; 0 if unknown
  double turn_rad = 0.0;       ///< change of heading, + to the left
  /// Further parameters of the task by name, same for all trials of a set (drawer: distances).
  std::vector<double> task;
};

/// Trajectories ξ̂ₙ(t) of several trials, all with the same rows, resampled to T samples a period.
struct Trials {
  std::vector<std::string> rows;  ///< names of the R trajectories of one trial, e.g. "lhip.x"
  std::vector<std::string> task_names;
  std::vector<Trial> trials;
  /// (trials·R)×T [rad], trial-major: row i·R + r is trajectory r of trial i; columns t = 0..T−1
  /// are the phases 2πt/T.
  Eigen::MatrixXd samples;

  Eigen::Index rows_per_trial() const { return static_cast<Eigen::Index>(rows.size()); }
};

}  // namespace mimesis::mocap
