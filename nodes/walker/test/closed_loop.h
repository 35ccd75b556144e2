#pragma once
#include <cmath>
#include <limits>

#include "common/model/files.h"
#include "nodes/walker/test/perfect_robot.h"
#include "nodes/walker/walker.h"
#include "nodes/walker/walker_messages.h"

namespace mimesis::walker::testing {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

inline const robot::Biped& biped() {
  static const robot::Biped b = model::load_biped("biped.yaml");
  return b;
}

inline int ticks(double seconds) { return static_cast<int>(std::lround(seconds / kTick_s)); }

/// A Walker and an ideal robot without a node: for the cost and the outputs of a tick. `step` of
/// the walker is the caller's, so that nothing else is measured.
class ClosedLoop {
 public:
  ClosedLoop(const robot::Biped& biped, const WalkerSettings& settings)
      : walker(biped, settings), robot(biped) {
    sensors.q = sensors.dq = Eigen::VectorXd::Zero(biped.tree.dof());
  }

  /// Sensor readings before a tick.
  const Sensors& sense() {
    if (std::string why = read_body(robot.sensors(), sensors); !why.empty()) fault = why;
    if (std::string why = read_joints(robot.joints(), sensors); !why.empty()) fault = why;
    return sensors;
  }
  /// The robot goes where the tick has sent it.
  void obey(const WalkerOutput& tick) {
    robot.q = tick.q;
    to_proto(tick, feedback_);
    to_proto(tick, balance_);
    robot.stand(feedback_);
    robot.stand(balance_);
  }

  Walker walker;
  PerfectRobot robot;
  Sensors sensors;
  std::string fault;  ///< fault of the sensors: none expected

 private:
  v1::WalkFeedback feedback_;
  v1::WalkBalance balance_;
};

/// Arms that swing and a chest that turns, within the limits: Biped::upper_body order.
inline void swing_upper_body(const robot::Biped& biped, double t_s, WalkerWish& wish) {
  constexpr double kSwing_rad = 0.3, kRate_rad_s = 3.9;
  const auto n = static_cast<Eigen::Index>(biped.upper_body.size());
  wish.upper_body.resize(n);
  wish.upper_body_rate.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int dof = biped.upper_body[static_cast<std::size_t>(i)];
    const double middle = biped.half_sitting[dof],
                 room =
                     std::min(biped.tree.upper()[dof] - middle, middle - biped.tree.lower()[dof]),
                 swing = std::clamp(0.8 * room, 0.0, kSwing_rad);
    wish.upper_body[i] = middle + swing * std::sin(kRate_rad_s * t_s);
    wish.upper_body_rate[i] = swing * kRate_rad_s * std::cos(kRate_rad_s * t_s);
  }
}

}  // namespace mimesis::walker::testing
