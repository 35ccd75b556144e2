#pragma once
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// Feedback of the divergent component of motion ξ = c + ċ/ω, ω = √(g/h) [C19]: of the error
/// e = ξ − ξ_r the wished ZMP is z_d = z_r + (1 + kd/ω) e + (ki/ω) ∫e. The linear inverted pendulum
/// ξ̇ = ω (ξ − z) then has ė = −kd e − ki ∫e.
class DcmFeedback {
 public:
  DcmFeedback(double com_height_m, const StabilizerSettings& settings);

  void reset();
  /// @param velocity_share  see Estimator: the planned velocity goes through the same filter, so
  ///        that a late measurement of a correct motion is no error
  void measure(const ComState& planned, const Eigen::Vector2d& com_W_m,
               const Eigen::Vector2d& com_v_W);
  /// Change of the ZMP. `saturated`: the last one was cut, ∫e only forgets. Along the heading
  /// `yaw_rad` the part of kd is limited (forward_limit_m).
  Eigen::Vector2d step(bool saturated, double yaw_rad);

  const Eigen::Vector2d& error_m() const { return error_; }
  double omega_1_s() const { return omega_; }

 private:
  const StabilizerSettings* settings_;
  double omega_, velocity_share_;
  bool first_ = true;
  Eigen::Vector2d planned_v_ = Eigen::Vector2d::Zero(), error_ = Eigen::Vector2d::Zero(),
                  integral_ = Eigen::Vector2d::Zero();
};

/// Shift of the CoM that brings the measured ZMP to the wished one [C19]:
/// a = k (z − z_d) − 2 v/T − x/T², |x| limited.
class ComAdmittance {
 public:
  explicit ComAdmittance(const StabilizerSettings& settings) : settings_(&settings) {}

  void reset() { shift_.setZero(), rate_.setZero(); }
  const Eigen::Vector2d& step(const Eigen::Vector2d& zmp_m, const Eigen::Vector2d& wished_zmp_m);
  const Eigen::Vector2d& shift_m() const { return shift_; }
  const Eigen::Vector2d& rate_m_s() const { return rate_; }

 private:
  const StabilizerSettings* settings_;
  Eigen::Vector2d shift_ = Eigen::Vector2d::Zero(), rate_ = Eigen::Vector2d::Zero();
};

}  // namespace mimesis::walker
