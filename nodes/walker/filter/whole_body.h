#pragma once
#include "common/robot/dynamics.h"
#include "common/robot/leg_ik.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Upper body at one instant: joints of Biped::upper_body, in that order.
struct UpperBody {
  Eigen::VectorXd q, dq, ddq;  ///< [rad], [rad/s], [rad/s²]
};

/// Motion of the whole robot that walks a plan: soles as planned, the upper body as given, the
/// pelvis upright and turned with the plan, at the place that puts the robot's centre of mass where
/// it is planned, at constant height; with velocities and accelerations. No allocation after
/// construction.
class WholeBody {
 public:
  /// The biped outlives it. @throws ConfigError as robot::LegIk
  WholeBody(const robot::Biped& biped, double com_height_m);

  /// Contribution of an upper body to the centre of mass: mass · CoM in B a little earlier, now and
  /// a little later [kg m].
  using Moments = std::array<Eigen::Vector3d, 3>;
  Moments moments(const UpperBody& upper);

  /// Centre of mass in B that the last search found, with its rates. As start of the search for the
  /// same sample a tick later it saves a third of the time.
  struct Lever {
    Eigen::Vector3d p_m, v, a, jerk;  ///< [m], [m/s], [m/s²], [m/s³]
    bool known = false;
  };

  /// `com` replaces the sample's CoM. `moments`: moments(upper). `lever`: null, or the lever that
  /// the last call for this sample has filled.
  const robot::RobotMotion& motion(const PatternSample& sample, const ComState& com,
                                   const UpperBody& upper, const Moments& moments,
                                   Lever* lever = nullptr);
  /// Zero moment point of motion() on the ground z = 0 by the full dynamics [m; docs/walking.md eq.
  /// 5.1]. Place and acceleration of the centre of mass are the plan's, f = m (c̈ + g ẑ), even
  /// where the search is not exact or a leg does not move: the pelvis is assumed to compensate the
  /// rest, so that the ground always carries the weight.
  Eigen::Vector2d zmp(const PatternSample& sample, const ComState& com, const UpperBody& upper,
                      const Moments& moments, Lever* lever = nullptr);
  /// A leg was stretched, limited or nearly straight in the last motion and was taken as rigid. A
  /// leg that bends less than usual moves in part.
  bool unreachable() const { return unreachable_; }

 private:
  using Vector6d = robot::LegIk::Vector6d;
  /// Pelvis and legs at an instant, and the goals that they follow.
  struct Posture {
    Eigen::Vector3d com_W;  ///< wished
    std::array<Eigen::Isometry3d, 2> X_WS;
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    Eigen::Vector3d lever_B;  ///< lever of the CoM
    std::array<Vector6d, 2> leg;
    /// mobility of a leg: 1, down to 0 when it is straight
    std::array<double, 2> freedom{1.0, 1.0};
  };
  void aim(double t, const PatternSample& sample, const ComState& com, Posture& out);
  void stand(const Eigen::Vector3d& lever_B, Posture& out);
  Eigen::Vector3d own_com_B(const Posture& posture, const Eigen::Vector3d& upper_moment);
  Eigen::Vector3d better_lever(const Posture& posture, const Eigen::Vector3d& com_B) const;
  void search(const Moments& moments, const Lever* lever);
  void calm(double share);
  void move_pelvis(const PatternSample& sample);
  void move_leg(Side side, double share);
  void move_upper_body(const UpperBody& upper);
  void remember(const Moments& moments, Lever& lever);
  void measure_lag();

  const robot::Biped* biped_;
  double com_height_;
  robot::Dynamics dynamics_;
  std::array<robot::LegIk, 2> ik_;
  robot::PartMass upper_mass_;
  std::array<robot::PartMass, 2> leg_mass_;
  double mass_;
  Eigen::Vector3d com_B_;  ///< CoM in half-sitting
  /// Pelvis shift needed per CoM shift above standing feet (the legs lag behind), by axis.
  Eigen::Vector3d gain_ = Eigen::Vector3d::Ones();
  Eigen::VectorXd upper_q_;
  std::array<Posture, 3> posture_;  ///< a little earlier, now, a little later
  Eigen::Vector3d now_com_B_ = Eigen::Vector3d::Zero();
  robot::RobotMotion motion_;
  bool unreachable_ = false, free_ = true;  ///< a leg, all legs
};

}  // namespace mimesis::walker
