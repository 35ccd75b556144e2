#pragma once
#include "nodes/synthesizer/drawer/action_maps.h"

namespace mimesis::synthesizer {

/// The drawer task's actions as learned from trials with any rows: upper body and pelvis velocity
/// (robot_trials.h, or what a pattern generator made feasible of them), or, for comparison, the
/// angles of all joints. Sources are learned stepwise, n₁ periodic ones from action 1 and n₂ more
/// from what those leave of the others, beside the non-periodic one [M18 3.3.3, 3.8.3]; maps lead
/// from what an action has to do to weights and means [M18 3.4.2].
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
  /// What the maps say for a task that was not in the training, rows × samples.
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
