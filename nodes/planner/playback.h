#pragma once
#include <Eigen/Core>

#include "nodes/planner/time_scaling.h"

namespace mimesis::planner {

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
