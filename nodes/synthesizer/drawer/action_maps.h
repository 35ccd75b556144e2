#pragma once
#include <array>
#include <vector>

#include "nodes/synthesizer/control/local_regression.h"
#include "nodes/synthesizer/control/parameters.h"
#include "nodes/synthesizer/drawer/action_plan.h"
#include "nodes/synthesizer/drawer/drawer_model.h"

namespace mimesis::synthesizer {

/// What an action has to do. Inputs of the maps: of action 1 the first two; of action 2 the first
/// three; of action 3 all but length and duration.
struct ActionTask {
  double length_m = 0.0, duration_s = 1.0;
  double previous_length_m = 0.0;  ///< of the action before: where the feet are
  double final_distance_m = 0.60;
  double object_depth_m = 0.25, object_lateral_m = 0.0;
};

/// Nonlinear maps from what an action has to do to the parameters of its mixture: weights and means
/// by locally weighted linear regression, one map for each action, clamped to what was trained
/// [M18 3.4.2].
class ActionMaps {
 public:
  /// `model`'s patterns of all actions are the same trials in the same order; those of one clip
  /// are left out together where bandwidths are searched; action 3 has a wide kernel unless one is
  /// given, but for its legs (where the rows are those of a body and its pelvis, kDrawerRows), which stand
  /// where the step before has put them: those have a map of that length alone. @throws ConfigError from the regression.
  explicit ActionMaps(DrawerModel model, const LocalRegressionOptions& options = {});

  /// Parameters of an action at `task`; frequency_rad_s from its duration.
  MotionParameters at(Action action, const ActionTask& task) const;
  const DrawerModel& model() const { return model_; }
  const ActionRanges& ranges() const { return ranges_; }
  const LocalRegression& map(Action action) const { return maps_[action]; }

  static Eigen::VectorXd inputs(Action action, const ActionTask& task);
  /// What trial i was.
  ActionTask task_of(Action action, std::size_t i) const;

 private:
  DrawerModel model_;
  ActionRanges ranges_;
  std::vector<LocalRegression> maps_;
  std::vector<LocalRegression> standing_legs_;  ///< one, by the length of the step before
};

}  // namespace mimesis::synthesizer
