#pragma once
#include <string>
#include <variant>
#include <vector>

#include "experiments/motion/gaussian_process.h"
#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/sequence/local_regression.h"

namespace mimesis::synthesizer {

/// One parameter of the task that motion depends on: a column of the trials' data.
struct TaskInput {
  enum class Kind { duration_s, step_length_m, turn_rad, task };
  Kind kind = Kind::duration_s;
  std::string name = "duration";  ///< one of motion::MotionModel::task_names for Kind::task

  static TaskInput duration() { return {Kind::duration_s, "duration"}; }
  static TaskInput step_length() { return {Kind::step_length_m, "step length"}; }
  static TaskInput turn() { return {Kind::turn_rad, "turn"}; }
  static TaskInput task(std::string name) { return {Kind::task, std::move(name)}; }
};

/// No node calls this yet: a model file keeps one pattern a style, too few to learn a map from; the
/// synthesizer blends the walk with standing instead.
///
/// Learned map from parameters of the task, as step length and duration, to the parameters of the
/// mixture: weights, means and frequency [M18 3.4.2], one output each. Delays are those of the
/// model, which must be tied (a map of free delays would average over their ambiguities). Inputs
/// outside of the recorded range are moved into it (InputDomain), and the result reports it.
///
/// On the cycles of one person (CMU 07, clips left out one by one) both kinds beat the nearest and
/// the mean trial; the Gaussian process is somewhat better in the middle, the local regression at
/// the ends.
class MotionMap {
 public:
  using Options = std::variant<LocalRegressionOptions, GaussianProcessOptions>;

  struct Value {
    MotionParameters parameters;
    double outside = 0.0;  ///< how far the task was moved into the domain, in standard deviations
    bool clamped() const { return outside > 0.0; }
  };

  /// Learns from all patterns of the model; cycles of one clip count as one where something is left
  /// out. @throws ConfigError: free delays, an unknown task name, fewer than two patterns, numbers
  /// that are not finite.
  MotionMap(const motion::MotionModel& model, const std::vector<TaskInput>& inputs,
            const Options& options);

  /// `task`: one number per input, in their units. @throws ConfigError for another size or a number
  /// that is not finite.
  Value at(const Eigen::Ref<const Eigen::VectorXd>& task) const;

 private:
  Eigen::MatrixXd delay_rad_;
  std::variant<LocalRegression, GaussianProcess> map_;
};

}  // namespace mimesis::synthesizer
