#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>
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

/// Reads trials from CSV: `clip,cycle,start_frame,end_frame,duration_s,joint,axis,t0,t1,...`, one
/// line per trial and row, a trial's lines together, the same rows in the same order in every
/// trial. Between duration_s and joint there may be columns `style`, `step_length_m`, `turn_rad`
/// and parameters of the task, numbers whose columns' names become task_names; the first line of a
/// trial counts. The axes are those of its first line if that is `# axes: x forward, y left, z up`;
/// else the file is one of shared/data/mocap/sets (z forward, x left, y up): joints 0..16 get the
/// body's names, axes are turned (x → y, y → z, z → x) and sorted so that a joint's rows are x, y,
/// z again. Row names are "joint.axis", or the joint's where the axis is empty. Units are those of
/// the names: joints in rad, else at the end of the row's name.
/// @throws ConfigError "file:line: what, expected ...": no trials, other columns, a number that is
/// not finite, rows that are missing, twice, or of another trial
Trials read_trials(const std::string& file);
/// Parses text in memory; `file` names it in errors.
Trials parse_trials(std::string_view text, const std::string& file);

}  // namespace mimesis::mocap
