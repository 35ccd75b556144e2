#pragma once
#include <gtest/gtest.h>

#include <functional>

#include "nodes/walker/tasks/test/reference.h"

namespace mimesis::walker {

inline constexpr double kDt = 0.005;
using Goals = std::function<TaskGoals(const Reference&, double t)>;

/// Results of a run of a stack.
struct Trial {
  double com_error_m = 0.0, foot_error_m = 0.0;  ///< worst
  double last_com_error_m = 0.0, last_foot_error_m = 0.0;
  double fastest = 0.0;       ///< largest share of the speed limits [1]
  double closest_rad = 1e9;   ///< to a limit
  double sharpest_rad_s = 0;  ///< greatest change of a velocity within a tick
  int limited = 0, ticks = 0;
  StackState state;
};

inline Trial trial_of(const robot::Biped& biped, double seconds, const Goals& goals) {
  const Reference reference(biped);
  Stack stack(biped, walking_stack(biped));
  const Eigen::VectorXd lower = biped.tree.lower(), upper = biped.tree.upper(),
                        speed = biped.tree.max_speed();
  Trial trial;
  Eigen::VectorXd dq = Eigen::VectorXd::Zero(biped.tree.dof());
  for (double t = kDt; t < seconds; t += kDt) {
    const StackState& state = stack.step(goals(reference, t), kDt);
    EXPECT_EQ(state.reason, "");
    trial.com_error_m = std::max(trial.com_error_m, state.com_error_m);
    trial.foot_error_m = std::max(trial.foot_error_m, state.foot_error_m);
    trial.last_com_error_m = state.com_error_m;
    trial.last_foot_error_m = state.foot_error_m;
    for (Eigen::Index i = 0; i < dq.size(); ++i) {
      trial.fastest = std::max(trial.fastest, std::abs(state.dq[i]) / speed[i]);
      trial.closest_rad =
          std::min({trial.closest_rad, upper[i] - state.q[i], state.q[i] - lower[i]});
    }
    trial.sharpest_rad_s = std::max(trial.sharpest_rad_s, (state.dq - dq).cwiseAbs().maxCoeff());
    dq = state.dq;
    trial.limited += state.limited;
    ++trial.ticks;
  }
  trial.state = stack.state();
  return trial;
}

/// `within_m`: 1e-6 on smooth references; joints at their top speeds leave more to curvature.
inline void expect_exact(const Trial& trial, const std::string& what, double within_m = 1e-6) {
  EXPECT_LT(trial.com_error_m, within_m) << what;
  EXPECT_LT(trial.foot_error_m, within_m) << what;
  EXPECT_EQ(trial.limited, 0) << what;
}

/// Margins and speed limits of the settings.
inline void expect_within_limits(const Trial& trial, const std::string& what) {
  EXPECT_GE(trial.closest_rad, 0.005 - 1e-9) << what;
  EXPECT_LE(trial.fastest, 0.98 + 1e-9) << what;
}

}  // namespace mimesis::walker
