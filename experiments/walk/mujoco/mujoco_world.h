#pragma once
#include "experiments/walk/mujoco/engine.h"
#include "experiments/walk/mujoco/mujoco_model.h"
#include "hw/sim/body/walk_judge.h"

namespace mimesis::walk {

/// The biped in MuJoCo: another physics than DART's (hw::sim::BodyWorld) to judge the walker, with
/// the same robot, motors, ground, steps, readings and falls. Its links, contacts and masses are
/// MuJoCo's own. Deterministic. Plates may not lie where the robot starts.
class MujocoWorld {
 public:
  /// @throws like MujocoEngine. The biped outlives this.
  MujocoWorld(const robot::Biped& biped, const hw::sim::BodyOptions& options);

  // As those of BodyWorld; the target has dof numbers.
  void step(std::span<const double> target, double duration_s);
  void push(const hw::sim::Push& push);
  const hw::sim::BodySensors& sensors() const { return sensors_; }
  const hw::sim::BodyTruth& truth() const { return truth_; }
  double time_s() const { return truth_.time_s; }

  /// Pose of any link.
  Eigen::Isometry3d X_WL(int link) const;

 private:
  using Row = Eigen::Map<const Eigen::VectorXd>;
  /// A force on a body's centre of mass in steps of the world, the last one excluded.
  struct RunningPush {
    int link;
    Eigen::Vector3d force_W_n;
    long first_step, last_step;
  };
  /// Sums over the steps of a tick, of the ground's forces.
  struct Ground {
    Eigen::Vector2d weighted_W = Eigen::Vector2d::Zero();  ///< sum of p·f_z
    double vertical_n = 0.0;
  };
  void wish(long step, std::span<double> row);
  void feel(std::span<const double> wish, const Row& row, Ground& ground);
  void observe(double duration_s);
  void judge();

  const robot::Biped* biped_;
  hw::sim::BodyOptions options_;
  MujocoModel model_;
  MujocoEngine engine_;
  hw::sim::FallJudge fall_;
  std::vector<RunningPush> pushes_;
  Eigen::VectorXd set_point_, row_;
  /// Set-points that the motors' ramps reached; where the motors are, and were a step ago: a load
  /// may turn them back.
  Eigen::VectorXd ramp_, motor_, motor_before_;
  Eigen::Vector3d v_imu_W_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_WI_ = Eigen::Matrix3d::Identity();
  hw::sim::SensorErrors errors_;
  long done_ = 0;
  hw::sim::BodySensors sensors_;
  hw::sim::BodyTruth truth_;
};

}  // namespace mimesis::walk
