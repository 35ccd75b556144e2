#pragma once
#include <algorithm>
#include <cmath>
namespace mimesis::hw::sim {

/// One simulated joint with its drive's position loop.
struct PlantParams {
  double bandwidth_rad_s = 150.0;  ///< ω of the position loop [rad/s]
  double v_max_rad_s = 4.0;        ///< largest speed of the motor, at the joint [rad/s]
  double a_max_rad_s2 = 40.0;      ///< largest acceleration of the motor, at the joint [rad/s²]
  double inertia_kg_m2 = 0.5;      ///< at the joint, for the torque estimate [kg m²]
  double friction_n_m_s = 2.0;     ///< viscous, for the torque estimate [N m s/rad]
};

/// Critically damped position loop with a saturating motor:
///   q̈ = sat(ω²(q_ref − q) + 2ω(v_ref − q̇), a_max), |q̇| ≤ v_max;  τ = J q̈ + b q̇.
/// Semi-implicit Euler in steps of at most 0.5 ms, stable for ω ≤ 1000 rad/s.
class AxisPlant {
 public:
  AxisPlant(const PlantParams& params, double q_rad) : params_(params), q_(q_rad) {}

  /// Tracks a reference that moves at `v_ref` and reaches `q_ref` after `dt` [s].
  void track(double q_ref, double v_ref, double dt) {
    if (jammed_) return lock();
    const int steps = std::max(1, static_cast<int>(std::ceil(dt / kLongestStep)));
    const double h = dt / steps, w = params_.bandwidth_rad_s;
    for (int i = 1; i <= steps; ++i) {
      const double reference = q_ref - v_ref * (dt - i * h);
      a_ = std::clamp(w * w * (reference - q_) + 2.0 * w * (v_ref - v_), -params_.a_max_rad_s2,
                      params_.a_max_rad_s2);
      v_ = std::clamp(v_ + a_ * h, -params_.v_max_rad_s, params_.v_max_rad_s);
      q_ += v_ * h;
    }
  }
  /// Velocity loop: q̈ = sat(2ω(v_ref − q̇), a_max).
  void turn(double v_ref, double dt) {
    accelerate(dt, [&] { return 2.0 * params_.bandwidth_rad_s * (v_ref - v_); });
  }
  /// Torque of the motor [N m]: q̈ = sat((τ − b q̇)/J, a_max).
  void push(double torque, double dt) {
    accelerate(dt, [&] { return (torque - params_.friction_n_m_s * v_) / params_.inertia_kg_m2; });
  }
  /// Decelerates at `deceleration` [rad/s²] for `dt` [s].
  void brake(double deceleration, double dt) {
    const double slowing = std::min(std::abs(v_), deceleration * dt);
    const double v = v_ - std::copysign(slowing, v_);
    const double time = deceleration > 0.0 ? slowing / deceleration : dt;
    a_ = (v - v_) / dt;
    q_ += 0.5 * (v_ + v) * time;
    v_ = v;
  }
  /// The mechanical brake: at rest at once.
  void lock() { v_ = a_ = 0.0; }
  /// An obstacle holds the joint from now on, or lets it go.
  void jam(bool on) { jammed_ = on; }

  double position() const { return q_; }  ///< [rad]
  double velocity() const { return v_; }  ///< [rad/s]
  /// [N m]
  double torque() const { return params_.inertia_kg_m2 * a_ + params_.friction_n_m_s * v_; }
  bool at_rest() const { return v_ == 0.0; }
  double held() const { return q_; }  ///< position from which a powered motor continues [rad]

 private:
  static constexpr double kLongestStep = 0.5e-3;  // [s]

  template <class Acceleration>
  void accelerate(double dt, const Acceleration& wanted) {
    if (jammed_) return lock();
    const int steps = std::max(1, static_cast<int>(std::ceil(dt / kLongestStep)));
    const double h = dt / steps;
    for (int i = 0; i < steps; ++i) {
      a_ = std::clamp(wanted(), -params_.a_max_rad_s2, params_.a_max_rad_s2);
      v_ = std::clamp(v_ + a_ * h, -params_.v_max_rad_s, params_.v_max_rad_s);
      q_ += v_ * h;
    }
  }

  PlantParams params_;
  double q_, v_ = 0.0, a_ = 0.0;
  bool jammed_ = false;
};

/// A joint whose motion a physics world computes. The drive moves the motor's set-point; the world
/// takes it and returns the readings of the joint's sensors.
class WorldJoint {
 public:
  explicit WorldJoint(double q_rad) : motor_(q_rad), position_(q_rad) {}

  // From the drive: the same calls as AxisPlant's, here for the motor.
  void track(double q_ref, double v_ref, double) {
    if (jammed_) return lock();
    motor_ = q_ref;
    rate_ = v_ref;
  }
  void turn(double v_ref, double dt) { track(motor_ + v_ref * dt, v_ref, dt); }
  void push(double, double) {}  ///< not offered: a world takes positions
  void brake(double deceleration, double dt) {
    const double slowing = std::min(std::abs(rate_), deceleration * dt);
    const double rate = rate_ - std::copysign(slowing, rate_);
    const double time = deceleration > 0.0 ? slowing / deceleration : dt;
    motor_ += 0.5 * (rate_ + rate) * time;
    rate_ = rate;
  }
  /// The brake on the motor's shaft: it stays where it is.
  void lock() { rate_ = 0.0; }
  void jam(bool on) { jammed_ = on; }
  double position() const { return position_; }  ///< [rad]
  double velocity() const { return velocity_; }  ///< [rad/s]
  double torque() const { return torque_; }      ///< [N m]
  bool at_rest() const { return rate_ == 0.0; }
  double held() const { return motor_; }  ///< position from which a powered motor continues [rad]

  // From and to the world.
  void measure(double position_rad, double velocity_rad_s, double torque_n_m) {
    position_ = position_rad;
    velocity_ = velocity_rad_s;
    torque_ = torque_n_m;
  }
  double motor() const { return motor_; }  ///< set-point at the end of the last move [rad]

 private:
  double motor_, rate_ = 0.0;
  double position_, velocity_ = 0.0, torque_ = 0.0;
  bool jammed_ = false;
};

}  // namespace mimesis::hw::sim
