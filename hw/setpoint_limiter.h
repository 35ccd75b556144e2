#pragma once
#include <Eigen/Core>
#include <span>
#include <string>

#include "hw/actuators.h"

namespace mimesis::hw {

/// Limits of the joints, from the robot's model; n elements each.
struct JointLimits {
  Eigen::VectorXd q_min, q_max;  ///< [rad]
  Eigen::VectorXd v_max;         ///< [rad/s]
  Eigen::VectorXd a_max;         ///< [rad/s²]
  Eigen::VectorXd j_max{};       ///< [rad/s³]; 0, or no elements: no limit
};

/// Last guard before the drives: turns a stream of positions into set-points that respect position,
/// velocity, acceleration and jerk. A stream within the limits passes unchanged; any other is
/// followed as closely as the limits allow. Without a limit of the jerk, with lag e behind the
/// stream, stream velocity v_s and cycle T the set-point moves at
///   v = v_s + sgn(e) min(|e|/T, w),  w = √((aT/2)² + 2a|e|) − aT/2,
/// w being the fastest approach that still comes to rest after |e| (w T/2 + w²/2a = |e|); then v is
/// held within v ± aT, ± v_max, and below the w of the distance to the joint's end. With one, the
/// acceleration is the largest towards the stream, at most jT from the last, after which the joint
/// can still come to rest at the stream and before its end within a and j. Stops come before
/// comfort: hold() and a stream that brakes change the acceleration at once.
class SetpointLimiter {
 public:
  /// @param dt_s cycle T [s]. Precondition: limits of equal size, v_max, a_max > 0.
  SetpointLimiter(JointLimits limits, double dt_s);

  /// Starts at rest at `q` [rad], the actual posture. A joint beyond its end may only move inwards.
  void reset(std::span<const double> q);
  /// Moves one cycle towards `target` [rad]. Does not allocate.
  /// @param brakes the stream stops the robot: no limit of the jerk
  /// @return true if a limit changed the set-point
  bool follow(std::span<const double> target, bool brakes = false);
  void rest() noexcept;
  /// The drives went on at their last velocity for `cycles` of which nobody told them.
  void coast(int cycles);
  /// Moves one cycle while coming to rest at a_max.
  void hold();

  const Eigen::VectorXd& position() const { return q_; }  ///< set-point [rad]
  const Eigen::VectorXd& velocity() const { return v_; }  ///< velocity of the set-point [rad/s]

 private:
  struct Stream {
    double end, velocity, acceleration;  ///< of the stream, now
  };
  void advance(Eigen::Index i, double wanted);
  void move(Eigen::Index i, double v);
  double smooth(Eigen::Index i, const Stream& stream) const;
  bool may(Eigen::Index i, double a, double towards, double slack) const;

  JointLimits limits_;
  double dt_;
  Eigen::VectorXd q_, v_, a_, target_, stream_;
};

/// What drivers of every kind share: the phase with its cause, and limited set-points. After a
/// fault a set-point is obeyed again only after Mode::idle.
class PhasedActuators : public Actuators {
 public:
  const Reading& reading() const { return reading_; }

 protected:
  PhasedActuators(const JointLimits& limits, double rate_hz, const std::string& searching)
      : limiter_(limits, 1.0 / rate_hz) {
    reading_.joints.resize(static_cast<std::size_t>(limits.q_min.size()));
    reading_.reason = searching;
  }

  void enter(Phase phase);
  void fault(const std::string& why);  ///< the first cause counts
  /// Changes the phase as the set-point asks, and moves the limiter. @param ready drives could be
  /// enabled now
  void obey(const Setpoint& setpoint, bool ready);
  /// After a stop that was sent outside of a cycle.
  void leave_motion() noexcept {
    if (reading_.phase == Phase::following || reading_.phase == Phase::enabling)
      enter(Phase::stopping);
  }

  SetpointLimiter limiter_;
  Reading reading_;
  Time now_{};      ///< time of the last read or write
  Time entered_{};  ///< when the phase began

 private:
  bool may_enable_ = true;  // Mode::idle was set since the last fault
};

}  // namespace mimesis::hw
