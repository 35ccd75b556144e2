#pragma once

namespace mimesis::hw::sim {

/// A joint whose motion a physics world computes. The drive moves the motor's set-point; the world
/// takes it and says what the joint's sensors measure.
class WorldJoint {
 public:
  explicit WorldJoint(double q_rad) : motor_(q_rad), position_(q_rad) {}

  // From the drive: the same calls as AxisPlant's, here for the motor.
  void track(double q_ref, double v_ref, double dt);
  void brake(double deceleration, double dt);
  /// The brake on the motor's shaft: it stays where it is.
  void lock() { rate_ = 0.0; }
  void jam() { jammed_ = true; }
  double position() const { return position_; }  ///< [rad]
  double velocity() const { return velocity_; }  ///< [rad/s]
  double torque() const { return torque_; }      ///< [N m]
  bool at_rest() const { return rate_ == 0.0; }
  double held() const { return motor_; }  ///< where a powered motor goes on from [rad]

  // From and to the world.
  void measure(double position_rad, double velocity_rad_s, double torque_n_m);
  double motor() const { return motor_; }  ///< set-point at the end of the last move [rad]

 private:
  double motor_, rate_ = 0.0;
  double position_, velocity_ = 0.0, torque_ = 0.0;
  bool jammed_ = false;
};

}  // namespace mimesis::hw::sim
