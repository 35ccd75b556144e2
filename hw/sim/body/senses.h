#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <random>

#include "common/robot/dynamics.h"

namespace mimesis::hw::sim {

/// Readings of encoders, IMU and foot force sensors. The same layout as walker::Sensors.
struct BodySensors {
  Eigen::VectorXd q, dq;   ///< dof; [rad], [rad/s]
  Eigen::VectorXd torque;  ///< dof; of the motors, mean of the step [N m]
  Eigen::Quaterniond R_WI = Eigen::Quaterniond::Identity();
  /// Means of the step, as an IMU sums them up inside; gyro_I · step is the turn of the step.
  Eigen::Vector3d gyro_I = Eigen::Vector3d::Zero(), specific_force_I = Eigen::Vector3d::Zero();
  std::array<robot::Wrench, 2> foot_S;  ///< about the sole's origin, in S, mean of the step
};

/// Errors of the sensors; all 0: exact. See kRealSenses.
struct Senses {
  /// Slowly wandering error of what the IMU takes for upright: of the attitude that it announces
  /// and, as a bias that wanders, of its accelerometer [rad].
  double imu_tilt_rad = 0.0;
  double gyro_bias_rad_s = 0.0;           ///< constant, each axis at random within ± this [rad/s]
  double gyro_noise_rad_s = 0.0;          ///< of each reading, deviation [rad/s]
  double accelerometer_bias_m_s2 = 0.0;   ///< constant, each axis at random within ± this [m/s²]
  double accelerometer_noise_m_s2 = 0.0;  ///< of each reading, deviation [m/s²]
  double encoder_noise_rad = 0.0;         ///< of each reading, deviation [rad]
  /// Encoders sit on the motors, before the springs, and do not see them give. The engine gives q
  /// and dq from there.
  bool motor_encoders = false;
  double force_noise_n = 0.0;  ///< of the feet's force sensors, deviation [N]

  template <class Visitor>
  void visit(Visitor& v) {
    v("imu_tilt_rad", imu_tilt_rad, 0.0, 0.5);
    v("gyro_bias_rad_s", gyro_bias_rad_s, 0.0, 1.0);
    v("gyro_noise_rad_s", gyro_noise_rad_s, 0.0, 1.0);
    v("accelerometer_bias_m_s2", accelerometer_bias_m_s2, 0.0, 5.0);
    v("accelerometer_noise_m_s2", accelerometer_noise_m_s2, 0.0, 5.0);
    v("encoder_noise_rad", encoder_noise_rad, 0.0, 0.1);
    v("motor_encoders", motor_encoders);
    v("force_noise_n", force_noise_n, 0.0, 1000.0);
  }
};

/// Typical sensors of a lab. The IMU is a calibrated industrial MEMS module. Noise of the Xsens
/// MTi-1 series: 0.007 °/s/√Hz over 255 Hz, 120 µg/√Hz over 324 Hz. Its data sheet gives the
/// stability of the biases in a run only, so biases are those left by a calibration: 5 mg as x-io
/// states for its x-IMU3, and 0.5 °/s, a generous bound of a gyro's turn-on bias.
inline constexpr Senses kRealSenses{.imu_tilt_rad = 0.005,
                                    .gyro_bias_rad_s = 0.0087,
                                    .gyro_noise_rad_s = 0.002,
                                    .accelerometer_bias_m_s2 = 0.05,
                                    .accelerometer_noise_m_s2 = 0.021,
                                    .encoder_noise_rad = 2e-4,
                                    .motor_encoders = true,
                                    .force_noise_n = 5.0};

/// Makes readings of true values; for any engine. The same for the same seed and calls.
class SensorErrors {
 public:
  SensorErrors(const Senses& senses, std::uint64_t seed);

  /// Error of upright at a time: about x and y of W, slow and smooth (0.05 to 0.4 Hz), at most
  /// `imu_tilt_rad` about each.
  Eigen::Quaterniond tilt(double time_s) const;
  /// @param readings  in: true values; out: what the sensors say. Call it once a step.
  void spoil(double time_s, BodySensors& readings);

 private:
  struct Wave {
    double frequency_hz, phase_rad;
  };
  void add_noise(double deviation, Eigen::Ref<Eigen::VectorXd> values);
  Eigen::Vector3d draw_bias(double most);

  Senses senses_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  Wave wave_[2][2];
  Eigen::Vector3d gyro_bias_I_, accelerometer_bias_I_;
};

}  // namespace mimesis::hw::sim
