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
    Eigen::Vector3d p_m, v, a;
    bool known = false;
  };

  /// `com` instead of the sample's. `moments` are those of `upper`. `lever`: null, or what the last
  /// call for this sample left there.
  const robot::RobotMotion& motion(const PatternSample& sample, const ComState& com,
                                   const UpperBody& upper, const Moments& moments,
                                   Lever* lever = nullptr);
  /// Zero moment point of that motion on the ground z = 0, by the full dynamics [m]; the sample's
  /// own where the motion would leave less than a fifth of the weight on the ground.
  Eigen::Vector2d zmp(const PatternSample& sample, const ComState& com, const UpperBody& upper,
                      const Moments& moments, Lever* lever = nullptr);
  /// Whether a leg was stretched or limited in the last motion: that leg is then taken to stand
  /// still.
  bool unreachable() const { return unreachable_; }

 private:
  using Vector6d = robot::LegIk::Vector6d;
  /// Pelvis and legs at an instant.
  struct Posture {
    Eigen::Vector3d p_WB, lever_B;  ///< lever: of the CoM
    std::array<Vector6d, 2> leg;
    std::array<bool, 2> fits{true, true};
  };
  void solve(double t, const PatternSample& sample, const ComState& com,
             const Eigen::Vector3d& upper_moment, const Lever* lever, Posture& out);
  void remember(Lever& lever) const;
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
  robot::RobotMotion motion_;
  bool unreachable_ = false;
};

}  // namespace mimesis::walker
