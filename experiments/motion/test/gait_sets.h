#pragma once
#include <string>

#include "common/motion/mocap/trials.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer::testing {

/// The shared folder, or empty if it is absent.
std::string shared_folder();

/// A set of data/mocap/sets ("A", "B"), clips whose name contains `clip` only. Style: the word of
/// the file name that says it. Stride [m]: travel of the root of the CMU BVH, 0 without one.
mocap::Trials gait_set(const std::string& name, const std::string& clip = "");

/// The trials of which keep(trial) holds.
template <class Keep>
mocap::Trials subset(const mocap::Trials& all, Keep keep) {
  mocap::Trials some{all.rows, all.task_names, {}, {}};
  const Eigen::Index rows = all.rows_per_trial();
  some.samples.resize(0, all.samples.cols());
  for (std::size_t i = 0; i < all.trials.size(); ++i) {
    if (!keep(all.trials[i])) continue;
    some.trials.push_back(all.trials[i]);
    some.samples.conservativeResize(some.samples.rows() + rows, Eigen::NoChange);
    some.samples.bottomRows(rows) =
        all.samples.middleRows(static_cast<Eigen::Index>(i) * rows, rows);
  }
  return some;
}

/// A model with tied delays (demix::sisa).
motion::MotionModel tied_model(const mocap::Trials& trials, int sources);

/// R×T.
Eigen::MatrixXd synthesize(const motion::MotionModel& model, const Eigen::VectorXd& mean_rad,
                           const Eigen::MatrixXd& weight_rad, const Eigen::MatrixXd& delay_rad);

}  // namespace mimesis::synthesizer::testing
