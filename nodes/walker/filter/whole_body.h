#pragma once
#include "common/robot/dynamics.h"
#include "common/robot/leg_ik.h"
#include "common/robot/part_mass.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Upper body at one instant: joints of Biped::upper_body, in that order.
struct UpperBody {
  Eigen::VectorXd q, dq, ddq;  ///< [rad], [rad/s], [rad/s²]
};

/// The whole robot that walks a plan: soles where they are planned, the upper body as given, the
/// pelvis upright, turned with the plan, and where the robot's centre of mass is the planned one at
/// a constant height. Velocities and accelerations belong to it. No allocation after construction.
class WholeBody {
 public:
  /// The biped outlives it. @throws ConfigError if a leg has no closed-form inverse kinematics
  WholeBody(const robot::Biped& biped, double com_height_m);

  /// What an upper body contributes to the centre of mass: mass · CoM in B a little earlier, now
  /// and a little later [kg m].
  using Moments = std::array<Eigen::Vector3d, 3>;
  Moments moments(const UpperBody& upper);

  /// Centre of mass in B as it was found, with its rates: a start for the next search, which saves
  /// a third of it. Meant for the same sample a tick later.
  struct Lever {
    Eigen::Vector3d p_m, v, a, jerk;  ///< [m], [m/s], [m/s²], [m/s³]
    bool known = false;
  };

  /// `com` instead of the sample's. `moments` are those of `upper`. `lever`: null, or what the last
  /// call for this sample left there.
  const robot::RobotMotion& motion(const PatternSample& sample, const ComState& com,
                                   const UpperBody& upper, const Moments& moments,
                                   Lever* lever = nullptr);
  /// Zero moment point of that motion on the ground z = 0, by the full dynamics [m]. Place and
  /// acceleration of the centre of mass are the plan's, f = m (c̈ + g ẑ): what the search leaves of
  /// them, because it is not exact or a leg does not move, the pelvis is taken to make up for, so
  /// that the ground always carries the weight.
  Eigen::Vector2d zmp(const PatternSample& sample, const ComState& com, const UpperBody& upper,
                      const Moments& moments, Lever* lever = nullptr);
  /// Whether a leg was stretched, limited or nearly straight in the last motion: it is then taken
  /// to be rigid. Where it bends less than usual it moves in part.
  bool unreachable() const { return unreachable_; }

 private:
  using Vector6d = robot::LegIk::Vector6d;
  /// Pelvis and legs at an instant, and what they follow.
  struct Posture {
    Eigen::Vector3d com_W;  ///< wished
    std::array<Eigen::Isometry3d, 2> X_WS;
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    Eigen::Vector3d lever_B;  ///< of the CoM
    std::array<Vector6d, 2> leg;
    std::array<double, 2> freedom{1.0, 1.0};  ///< of a leg to move: 1, to 0 when it is straight
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
  Eigen::Vector3d com_B_;  ///< half-sitting
  /// Of a shift of the pelvis above standing feet the CoM makes 1/gain: legs lag behind.
  Eigen::Vector3d gain_ = Eigen::Vector3d::Ones();
  Eigen::VectorXd upper_q_;
  std::array<Posture, 3> posture_;  ///< a little earlier, now, a little later
  Eigen::Vector3d now_com_B_ = Eigen::Vector3d::Zero();
  robot::RobotMotion motion_;
  bool unreachable_ = false, free_ = true;  ///< a leg, all legs
};

}  // namespace mimesis::walker
