#pragma once
#include <array>
#include <vector>

#include "common/motion/demix/mixture.h"
#include "common/motion/model/motion_model.h"
#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/sequence/action_plan.h"
#include "nodes/synthesizer/sequence/local_regression.h"
#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {

struct DrawerModelOptions {
  int first_sources = 3;    ///< periodic, learned from action 1
  int further_sources = 2;  ///< periodic, learned from what those leave of action 2
  int turns = 40;           ///< these three as in demix::SisaOptions
  double tolerance = 1e-4;
  std::uint32_t seed = 1;
};

/// The three actions as mixtures of the same sources [M18 3.3.3, "Stepwise estimation"]: source 0
/// is the non-periodic s₀(t) = cos(πt/T), then those of action 1, then the further ones. Delays are
/// the same in all trials and actions, so that transitions blend weights and means alone.
struct DrawerModel {
  mocap::Body body;
  Drawer drawer;
  DrawerModelOptions options;
  /// Patterns in the order of the trials. Action 1 has weight 0 on the further sources.
  std::array<motion::MotionModel, kActions> action;
  double quality_squared = 0.0;        ///< Q2 of all actions together, all sources
  double first_quality_squared = 0.0;  ///< Q2 of action 1 with its sources
};

/// Learns the model: action 1 with tied delays; then actions 2 and 3 with those sources and delays,
/// weights estimated again, and the further sources from the residual of both. (The text takes the
/// residuals of action 2 for the further sources and only new weights for action 3: its residuals
/// are then the largest of all.) Some seconds for 40 trials.
/// @throws ConfigError from demix::sisa.
DrawerModel learn_drawer_model(const DrawerData& data, const DrawerModelOptions& options = {});

/// Task of an action. Inputs of the maps: for action 1 the first two; for action 2 the first three;
/// for action 3 all but length and duration.
struct ActionTask {
  double length_m = 0.0, duration_s = 1.0;
  double previous_length_m = 0.0;  ///< length of the action before: place of the feet
  double final_distance_m = 0.60;
  double object_depth_m = 0.25, object_lateral_m = 0.0;
};

/// Nonlinear maps from the task of an action to the parameters of its mixture: weights and means by
/// locally weighted linear regression, one map for each action, clamped to the trained range [M18
/// 3.4.2].
class ActionMaps {
 public:
  /// `model`'s patterns of all actions are the same trials in the same order; those of one clip
  /// are left out together where bandwidths are searched; action 3 has a wide kernel unless one is
  /// given, but for its legs (where the rows are those of a body and its pelvis, kDrawerRows),
  /// which stand where the step before has put them: those have a map of that length alone. @throws
  /// ConfigError from the regression.
  explicit ActionMaps(DrawerModel model, const LocalRegressionOptions& options = {});

  /// Parameters of an action at `task`; frequency_rad_s from its duration.
  MotionParameters at(Action action, const ActionTask& task) const;
  const DrawerModel& model() const { return model_; }
  const ActionRanges& ranges() const { return ranges_; }
  const LocalRegression& map(Action action) const { return maps_[action]; }

  static Eigen::VectorXd inputs(Action action, const ActionTask& task);
  ActionTask task_of(Action action, std::size_t i) const;

 private:
  DrawerModel model_;
  ActionRanges ranges_;
  std::vector<LocalRegression> maps_;
  std::vector<LocalRegression> standing_legs_;  ///< one, by the length of the step before
};

/// The drawer task's actions as learned from trials with any rows: upper body and pelvis velocity
/// (robot_trials.h, or trials made feasible by a pattern generator), or, for comparison, the angles
/// of all joints. Sources are learned stepwise, n₁ periodic ones from action 1 and n₂ more from the
/// residual of the others, beside the non-periodic one [M18 3.3.3, 3.8.3]; maps lead from the task
/// of an action to weights and means [M18 3.4.2].
class LearnedActions {
 public:
  /// Some seconds for 40 trials. @throws ConfigError from learn_drawer_model() and ActionMaps
  LearnedActions(const DrawerData& data, const DrawerModelOptions& options);

  const ActionMaps& maps() const { return maps_; }
  const ActionRanges& ranges() const { return maps_.ranges(); }
  const std::vector<std::string>& rows() const { return maps_.model().action[0].rows; }
  Eigen::Index row_count() const { return static_cast<Eigen::Index>(rows().size()); }

  /// Values of all rows at phase φ of an action, [0, 2π). `out`: row_count(). No allocation.
  void at(const MotionParameters& parameters, double phase_rad,
          Eigen::Ref<Eigen::VectorXd> out) const;
  /// The mixture of a training trial, rows × samples (as many as were learned from).
  Eigen::MatrixXd reconstruct(Action action, std::size_t trial) const;
  /// Result of the maps for a task that was not in the training, rows × samples.
  Eigen::MatrixXd infer(Action action, const ActionTask& task) const;

 private:
  Eigen::MatrixXd played(const MotionParameters& parameters) const;
  ActionMaps maps_;
};

/// Mean of a velocity row times the duration: the travel that rows ask for [m]. `rows`: of one
/// action, rows × samples. @throws ConfigError if there is no row pelvis.forward_m_s.
double travel_m(const std::vector<std::string>& names, const Eigen::MatrixXd& rows,
                double duration_s);

}  // namespace mimesis::synthesizer
