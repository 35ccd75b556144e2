#include "hw/sim/body/senses.h"

#include <cmath>
#include <numbers>

namespace mimesis::hw::sim {
namespace {

/// Speed of a joint by differences of its encoder over this time.
constexpr double kEncoderSpan_s = 0.01;
/// A force sensor of about this size turns errors of force into such of moment.
constexpr double kForceSensor_m = 0.1;

}  // namespace

SensorErrors::SensorErrors(const Senses& senses, std::uint64_t seed)
    : senses_(senses), random_(seed) {
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi), slow(0.05, 0.15),
      fast(0.2, 0.4);
  for (auto& axis : wave_) {
    axis[0] = {slow(random_), phase(random_)};
    axis[1] = {fast(random_), phase(random_)};
  }
  gyro_bias_I_ = draw_bias(senses.gyro_bias_rad_s);
  accelerometer_bias_I_ = draw_bias(senses.accelerometer_bias_m_s2);
}

Eigen::Vector3d SensorErrors::draw_bias(double most) {
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  Eigen::Vector3d bias;
  for (double& x : bias) x = most * share(random_);
  return bias;
}

Eigen::Quaterniond SensorErrors::tilt(double time_s) const {
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    for (const Wave& wave : wave_[axis]) {
      error[axis] += 0.5 * senses_.imu_tilt_rad *
                     std::sin(2.0 * std::numbers::pi * wave.frequency_hz * time_s + wave.phase_rad);
    }
  }
  return Eigen::AngleAxisd(error.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(error.x(), Eigen::Vector3d::UnitX());
}

void SensorErrors::add_noise(double deviation, Eigen::Ref<Eigen::VectorXd> values) {
  if (deviation <= 0.0) return;
  for (double& value : values) value += deviation * normal_(random_);
}

void SensorErrors::spoil(double time_s, BodySensors& readings) {
  add_noise(senses_.encoder_noise_rad, readings.q);
  add_noise(senses_.encoder_noise_rad / kEncoderSpan_s, readings.dq);
  // f_I = Rᵀ Tᵀ (a + g ẑ): the accelerometer errs as much as the attitude T R
  const Eigen::Quaterniond wrong = tilt(time_s);
  readings.specific_force_I =
      readings.R_WI.conjugate() * (wrong.conjugate() * (readings.R_WI * readings.specific_force_I));
  readings.R_WI = wrong * readings.R_WI;
  readings.gyro_I += gyro_bias_I_;
  readings.specific_force_I += accelerometer_bias_I_;
  add_noise(senses_.gyro_noise_rad_s, readings.gyro_I);
  add_noise(senses_.accelerometer_noise_m_s2, readings.specific_force_I);
  for (robot::Wrench& wrench : readings.foot_S) {
    add_noise(senses_.force_noise_n, wrench.force);
    add_noise(kForceSensor_m * senses_.force_noise_n, wrench.moment);
  }
}

}  // namespace mimesis::hw::sim
