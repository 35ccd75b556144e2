#pragma once
#include <Eigen/Core>

#include "nodes/planner/smooth_path.h"

namespace mimesis::planner {

/// A motion sampled at a fixed period; first and last sample at rest.
struct JointTrajectory {
  double period_s = 0.005;
  Eigen::MatrixXd position;  ///< n × samples [rad]
  Eigen::MatrixXd velocity;  ///< n × samples [rad/s]

  Eigen::Index samples() const { return position.cols(); }
  double duration_s() const { return period_s * static_cast<double>(samples() - 1); }
};

/// Fastest motion along q(s) with |q̇ⱼ| ≤ vⱼ and |q̈ⱼ| ≤ aⱼ, at rest at every stop of the path.
///
/// With x = ṡ² and u = s̈ the limits are linear: |q'ⱼ u + q''ⱼ x| ≤ aⱼ, x ≤ (vⱼ/q'ⱼ)², and x' = x +
/// 2 u Δs from one grid point to the next (u constant between). Backwards from the end: the largest
/// x from which the rest can be driven; then forwards: the largest u that stays below it.
/// (Reachability analysis on the phase plane, Pham & Pham 2018.) The duration is then stretched to
/// a whole number of periods. O(grid points × n × bisections).
JointTrajectory time_optimal(const SmoothPath& path, const Eigen::VectorXd& v_max_rad_s,
                             const Eigen::VectorXd& a_max_rad_s2, double period_s);

/// Plays a trajectory, one call a period; can brake on the path.
class Playback {
 public:
  /// @param brake_s  time in which `brake` brings a motion at full pace to rest [s]
  explicit Playback(double brake_s = 0.5) : brake_s_(brake_s) {}

  void start(JointTrajectory trajectory);
  /// From now on the pace falls evenly to zero: q(σ(t)), σ̇ from 1 to 0 in brake_s. Stays on the
  /// path.
  void brake() { braking_ = true; }
  /// Advances by one period.
  void advance();
  /// At the end, or braked to rest.
  bool at_rest() const { return pace_ <= 0.0 || at_ >= trajectory_.duration_s(); }

  Eigen::VectorXd position() const;  ///< [rad]
  Eigen::VectorXd velocity() const;  ///< [rad/s]

 private:
  /// Sample before `at_` and the part of a period since then.
  std::pair<Eigen::Index, double> sample() const;

  double brake_s_;
  JointTrajectory trajectory_;
  double at_ = 0.0;    // σ [s]
  double pace_ = 0.0;  // σ̇ [1]
  bool braking_ = false;
};

}  // namespace mimesis::planner
