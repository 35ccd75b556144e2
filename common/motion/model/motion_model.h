#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/motion/demix/mixture.h"
#include "common/motion/mocap/body.h"
#include "common/motion/mocap/trials.h"

namespace mimesis::motion {

/// One learned way to move: the parameters of the mixture for the R rows of the model.
struct Pattern {
  mocap::Trial trial;          ///< trial it was learned from: style, duration, step length, turn
  Eigen::VectorXd mean_rad;    ///< m, R
  Eigen::MatrixXd weight_rad;  ///< w, R×K
  Eigen::MatrixXd delay_rad;   ///< φ, R×K; with tied delays the same in all patterns
};

/// Where a row ends, for joints of a robot [rad].
struct RowLimits {
  double lower = 0.0, upper = 0.0;  ///< lower < upper
};

struct Source {
  std::string file;     ///< name without folder
  std::string sha256;   ///< hex
  std::string licence;  ///< licence as stated by the user, or empty
};

/// Everything a synthesizer needs, as `mimesis demix` learns it. A file of format
/// "mimesis.motion" (JSON, *.motion.json), version 1.
struct MotionModel {
  std::string name, created_by;  ///< program version and options
  std::vector<Source> learned_from;
  mocap::Body body;
  std::vector<std::string> rows;        ///< R names: body rows "lhip.x", or joints of a robot
  std::vector<std::string> task_names;  ///< names of the values of Trial::task
  /// By row, limits that must not be passed (clamp_to_limits()); empty: no row has any. In the file
  /// "limits_rad", [lower, upper] or null by row, and absent if empty: version 1 without it is read
  /// as before, and programs that do not know it read files that have it.
  std::vector<std::optional<RowLimits>> limits_rad{};
  Eigen::MatrixXd sources;  ///< K×T, one period [1]
  int fixed = 0;            ///< the first are non-periodic (demix::Mixture)
  bool tied = false;        ///< one delay per row and source
  std::vector<Pattern> patterns;
  double quality = 0.0, quality_squared = 0.0;  ///< Q and Q2 over the training data
};

/// @throws ConfigError "file: what (where), expected ...": damaged, another version, sizes that do
/// not fit, a number that is not finite.
MotionModel load_motion_model(const std::string& file);
/// Parses text in memory; `file` names it in errors.
MotionModel parse_motion_model(std::string_view text, const std::string& file);
/// @throws ConfigError if the file cannot be written; whole or not at all.
void save_motion_model(const MotionModel& model, const std::string& file);

// Joint limits of a model's rows. A mixture is an approximation, so it passes limits that its
// trials kept; demix reports by how much. Blends of patterns with tied delays and shares that are
// not negative and sum to 1 stay between their patterns, row by row and at every phase: they keep
// what the patterns keep. Other shares (exaggerated styles, weights that change sign), parameters
// from maps and cross-fades between models can pass limits.

/// Moves values that are beyond their row's limits to the limit (of floats: the last one within).
/// Rows without limits stay. Values that are not numbers become the lower limit. Does not allocate.
/// @param values  R of them [rad], in the model's order
/// @return number of rows that were moved
int clamp_to_limits(const MotionModel& model, std::span<float> values);
int clamp_to_limits(const MotionModel& model, std::span<double> values);

/// How near to its limits a row comes, over all patterns and the T phases of the sources.
struct LimitExcess {
  std::string row;
  double beyond_rad = 0.0;  ///< largest excess; negative: distance to the nearer limit
  std::size_t pattern = 0;  ///< where that is
  double phase_rad = 0.0;
};
/// Excess of every row with limits, in the model's order.
std::vector<LimitExcess> limit_excess(const MotionModel& model);

/// The model of a mixture over a set: one pattern a trial. Name and provenance stay empty.
/// @param tied  the mixture has one delay per row of a trial and source
/// @throws ConfigError if the mixture is not one over the set
MotionModel make_model(const mocap::Trials& set, const demix::Mixture& mixture, bool tied,
                       const mocap::Body& body);

/// One pattern a style, in order of first appearance: the mean over its patterns, of duration, step
/// length, turn and task too; clip and frames are those of the first.
/// @throws ConfigError if the model's delays are not tied: free ones have no mean
MotionModel average_styles(const MotionModel& model);

}  // namespace mimesis::motion
