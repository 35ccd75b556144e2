#pragma once
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/robot/biped.h"
#include "common/robot/dynamics.h"

namespace mimesis::hw::sim {

/// How joints follow their set-points [walking.md 8.3].
enum class Plant {
  kSprings,  ///< B: joint springs of 6000 N m/rad
  kServo,    ///< C: velocity servos, rubber bush of 1500 N m/rad in the ankles
};

/// A plate on the ground, unknown to the robot.
struct Plate {
  Eigen::Vector2d center_W_m = Eigen::Vector2d::Zero(), half_m{0.25, 0.5};
  double height_m = 0.005;
};

/// A push: constant force for a while.
struct Push {
  double at_s = 0.0, duration_s = 0.1;
  Eigen::Vector3d impulse_W_ns = Eigen::Vector3d::Zero();
  std::string link;  ///< empty: the trunk
};

enum class MotorFault { kOff, kLocked, kWeak };

struct BodyOptions {
  Plant plant = Plant::kSprings;
  double dt_s = 0.001;
  double friction = 0.8;
  Eigen::Vector2d slope_rad = Eigen::Vector2d::Zero();  ///< of the ground, about y and x
  std::vector<Plate> plates;
  double payload_kg = 0.0;                                   ///< unknown mass in the trunk
  double motor_speed_share = 1.0, motor_torque_share = 1.0;  ///< of the URDF's limits
  // noise of sensors, seeded
  std::uint64_t seed = 0;
  double imu_tilt_rad = 0.0;  ///< slow wandering error of the attitude
  double encoder_noise_rad = 0.0;
  double force_noise_n = 0.0;
};

/// What encoders, IMU and foot force sensors say. The same layout as walker::Sensors.
struct BodySensors {
  Eigen::VectorXd q, dq, torque;  ///< dof [rad], [rad/s], [N m]
  Eigen::Quaterniond R_WI = Eigen::Quaterniond::Identity();
  Eigen::Vector3d gyro_I = Eigen::Vector3d::Zero(), specific_force_I = Eigen::Vector3d::Zero();
  std::array<robot::Wrench, 2> foot_S;  ///< about the sole's origin, in S, mean of the step
};

/// What really happens.
struct BodyTruth {
  double time_s = 0.0;
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  std::array<Eigen::Isometry3d, 2> X_WS;
  std::array<Eigen::Vector3d, 2> hand_W_m;
  Eigen::Vector3d com_W_m, com_v_W;
  Eigen::Vector2d zmp_W_m;           ///< from the contact forces; the last one while in the air
  std::array<double, 2> normal_n{};  ///< of each foot, mean over the step
  std::array<double, 2> ankle_pitch_n_m{};  ///< from the foot's wrench [walking.md 8.2]
  double most_normal_n = 0.0;               ///< sum of both feet, raw, highest of the step
  bool fell = false;  ///< CoM below 60 % of its height or trunk tilted by 0.9 rad: stays true
  std::string how;    ///< it fell
};

/// The biped in DART: contacts, joints, sensors, trouble. Deterministic. One instance a thread.
class BodyWorld {
 public:
  /// Reads the same URDF as RobotTree did; standing half-sitting on the ground.
  /// @throws ConfigError if DART cannot read it or it has other joints
  BodyWorld(const robot::Biped& biped, const std::string& urdf_file, const BodyOptions& options);
  ~BodyWorld();

  /// Moves on by `duration_s` (a multiple of dt) while the set-points go linearly to `target`
  /// (dof [rad]).
  void step(std::span<const double> target, double duration_s);
  void push(const Push& push);  ///< at_s: graph time of this world
  void fail(int joint, MotorFault fault);
  /// Constant force on a link's point from now on, until it is set again; in W.
  void pull(int link, const Eigen::Vector3d& point_L_m, const Eigen::Vector3d& force_W_n);

  const BodySensors& sensors() const;
  const BodyTruth& truth() const;
  double time_s() const;
};

}  // namespace mimesis::hw::sim
