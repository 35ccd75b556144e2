#pragma once
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// Feedback of the divergent component of motion ξ = c + ċ/ω, ω = √(g/h) [C19; docs/walking.md
/// eq. 6.1]. For the error e = ξ − ξ_r the wished ZMP is z_d = z_r + (1 + kd/ω) e + (ki/ω) ∫e, so
/// that the linear inverted pendulum ξ̇ = ω (ξ − z) has ė = −kd e − ki ∫e.
class DcmFeedback {
 public:
  DcmFeedback(double com_height_m, const StabilizerSettings& settings);

  void reset();
  /// The planned velocity passes the filter of the measured one (see Estimator), so that a late
  /// measurement of a correct motion is no error.
  void measure(const ComState& planned, const Eigen::Vector2d& com_W_m,
               const Eigen::Vector2d& com_v_W);
  /// @return z_d − z_r. `saturated`: the last one was cut; ∫e only forgets. Along the heading
  /// `yaw_rad` the term of kd is limited (forward_limit_m).
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

/// CoM admittance: shift x of the CoM that brings the measured ZMP to the wished one
/// [C19; docs/walking.md eq. 6.2], ẍ = k (z − z_d) − 2 ẋ/T − x/T², |x| limited.
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

/// Moves landings when the soles are too small for a push [Englsberger, Ott, Albu-Schäffer 2015;
/// docs/walking.md eq. 6.7]. While the wished ZMP is cut to z_r + d, the error e of the divergent
/// component grows until the landing in t to
///   e_T = (e − d) exp(ω t) + d
/// along and across the heading, without changing sign: where d exceeds e the soles suffice. A foot
/// that lands e_T further removes the error if the whole pattern continues from there, so the
/// pattern moves by the offset of the foot that has landed. The other foot keeps its place, as an
/// offset from the moved pattern, until its next swing; the wished CoM follows the pattern slowly.
/// Protocol: step() returns how far to move the pattern; the plan of the next tick has moved.
class StepAdjustment {
 public:
  explicit StepAdjustment(const StabilizerSettings& settings);

  void reset();
  /// First call of a tick: subtracts the last movement of the pattern from all offsets.
  void follow();
  /// Error of the divergent component at this tick, and how much of it the soles can answer.
  struct Balance {
    Eigen::Vector2d error_W_m, zmp_change_W_m;  ///< e, d
    bool cut = false;                           ///< d is smaller than wished
    double omega_1_s = 0.0;
  };
  /// @return how far the whole pattern has to move after this tick; 0 except at landings
  Eigen::Vector2d step(const PatternSample& plan, const Balance& balance);

  /// Offset of the foot's goal from its plan.
  const Eigen::Vector2d& foot_W_m(Side side) const { return foot_[side]; }
  /// Offset of the wished CoM from the planned one.
  const Eigen::Vector2d& com_W_m() const { return com_; }
  const Eigen::Vector2d& com_v_W() const { return com_v_; }

 private:
  /// e_T in the heading frame.
  Eigen::Vector2d landing_error(const PatternSample& plan, const Balance& balance) const;
  /// @param wish  in the heading frame. @return in W
  Eigen::Vector2d within_reach(const PatternSample& plan, Eigen::Vector2d wish) const;

  const StabilizerSettings* settings_;
  double share_;
  std::array<Eigen::Vector2d, 2> foot_;
  std::array<bool, 2> in_air_{false, false};
  Eigen::Vector2d com_, com_v_, moved_;  ///< moved_: pattern since the last follow()
};

}  // namespace mimesis::walker
