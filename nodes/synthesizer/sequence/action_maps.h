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
/// 3.4.2]. Trials may have any rows: a body and its pelvis (kDrawerRows), a robot's upper body and
/// its velocity (robot_trials.h), or, for comparison, the angles of all joints [M18 3.8.3].
class ActionMaps {
 public:
  /// `model`'s patterns of all actions are the same trials in the same order; those of one clip
  /// are left out together where kernels are searched. Each action has one kernel for its rows, a
  /// wide one in action 3, but
  /// - velocities (names in _m_s, _rad_s) of actions 1 and 2 have their own: length alone decides
  ///   them, posture has a person's manner in it;
  /// - legs and pelvis of action 3 (kDrawerRows) have a map of the length of the step before, which
  ///   has put them where they stand.
  /// @throws ConfigError from the regression.
  explicit ActionMaps(DrawerModel model);

  /// Parameters of an action at `task`; frequency_rad_s from its duration.
  MotionParameters at(Action action, const ActionTask& task) const;
  const DrawerModel& model() const { return model_; }
  const ActionRanges& ranges() const { return ranges_; }
  Eigen::Index row_count() const { return std::ssize(model_.action[0].rows); }

  static Eigen::VectorXd inputs(Action action, const ActionTask& task);
  ActionTask task_of(Action action, std::size_t i) const;

 private:
  struct Part {
    std::vector<Eigen::Index> rows;
    LocalRegression map;  ///< of the first so many inputs
  };
  void add(Action action, const std::vector<Eigen::Index>& rows, Eigen::Index inputs_used,
           const LocalRegressionOptions& options);

  DrawerModel model_;
  ActionRanges ranges_;
  std::array<std::vector<Part>, kActions> parts_;
};

}  // namespace mimesis::synthesizer
