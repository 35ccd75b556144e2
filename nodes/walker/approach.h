#pragma once
#include <Eigen/Core>

namespace mimesis::walker {

/// Slow way of all joints from one posture to another, together, with minimum jerk:
/// q = a + (b − a)(10 s³ − 15 s⁴ + 6 s⁵), s = t/T [Flash, Hogan 1985].
class Approach {
 public:
  /// No joint is faster than `speed_share` · `max_speed` (dof [rad/s]); takes `least_s` or longer.
  void start(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
             const Eigen::VectorXd& max_speed, double speed_share, double least_s);
  void step(double dt_s);  ///< no allocation

  const Eigen::VectorXd& q() const { return q_; }    ///< [rad]
  const Eigen::VectorXd& dq() const { return dq_; }  ///< [rad/s]
  bool done() const { return t_s_ >= duration_s_; }
  double duration_s() const { return duration_s_; }

 private:
  Eigen::VectorXd from_, way_, q_, dq_;
  double duration_s_ = 0.0, t_s_ = 0.0;
};

}  // namespace mimesis::walker
