#pragma once
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nodes/walker/filter/dynamic_filter.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/stabilizer.h"
#include "nodes/walker/tasks/stack.h"

namespace mimesis::walker {

struct UpperBodySettings {
  double gain_1_s = 20.0;             ///< k, gain of the distance to the wish
  double speed_share = 0.9;           ///< used share of the joints' speed limits [1]
  double acceleration_rad_s2 = 40.0;  ///< largest acceleration of a joint
  double margin_rad = 0.01;           ///< kept from the joints' limits
};

/// Follows a wished posture of the upper body within limits of position, speed and acceleration:
/// q̇ = rate + k (wish − q), never faster than it can brake before the wish. A wish that stays
/// within the limits and begins at the present posture is followed without lag.
class UpperBodyFollower {
 public:
  UpperBodyFollower(const robot::Biped& biped, const UpperBodySettings& settings);

  void reset();  ///< half-sitting, at rest
  /// Sets the wish [rad], [rad/s] in the order of Biped::upper_body; empty: half-sitting. A wish of
  /// another size or with values that are not finite is refused; the last good one stays, at rest.
  /// No allocation.
  /// @return false if it was refused
  bool wish(const Eigen::VectorXd& q, const Eigen::VectorXd& rate);
  void step();

  const UpperBody& now() const { return now_; }
  bool clipped() const { return clipped_; }  ///< the wish is beyond the limits
  /// Prediction for `samples` (at most 64) instants, `dt_s` apart, beginning now. The wish is
  /// unknown, so the motion is assumed to continue and come to rest within about `settle_s`.
  std::span<const UpperBody> ahead(int samples, double dt_s, double settle_s);

 private:
  UpperBodySettings settings_;
  Eigen::VectorXd half_sitting_, lower_, upper_, speed_;
  Eigen::VectorXd wish_, rate_;
  UpperBody now_;
  std::vector<UpperBody> ahead_;
  bool clipped_ = false;
};

enum class PatternKind { nonlinear, linear, preview };

struct WalkerSettings {
  PatternKind pattern = PatternKind::nonlinear;
  bool filter = true;     ///< dynamic filter; false: the cart-table's CoM unchanged
  bool stabilize = true;  ///< feedback; false: by plan alone
  FilterSettings filter_settings;
  StabilizerSettings stabilizer;
  UpperBodySettings upper_body;
  StackSettings stack;                 ///< without tasks: walking_stack()
  std::optional<GaitSettings> gait{};  ///< empty: gait_settings(biped)
};

struct WalkerWish {
  Wish walk;
  /// [rad], [rad/s], in the order of Biped::upper_body; both empty: half-sitting.
  Eigen::VectorXd upper_body, upper_body_rate;
  std::array<TaskGoals::Hand, 2> hand;  ///< left, right, in W
};

struct WalkerOutput {
  Eigen::VectorXd q, dq;  ///< set-points, dof [rad], [rad/s], within their limits
  PatternSample pattern;  ///< plan of this tick
  ComState com;           ///< planned, with the filter's shift
  StabilizerCommand stabilizer;
  Eigen::Isometry3d X_WB;  ///< planned pelvis
  /// By encoders and IMU from the standing feet; as planned where sensors cannot be used. Zero, or
  /// identity, for a hand or a head that the robot has not.
  std::array<Eigen::Vector3d, 2> hand_W_m{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  Eigen::Isometry3d X_WH = Eigen::Isometry3d::Identity();  ///< link of the head
  std::string trouble;  ///< first trouble of the tick in one line; empty: none
  // Deviations from the wish at this tick:
  bool failed = false;   ///< a solve of pattern or stack failed; the last good plan continues
  bool clipped = false;  ///< the wish was beyond the robot and was cut
  bool limited = false;  ///< a joint limit keeps feet or CoM from their goals
};

/// From a wished walk to joint set-points: pattern, filter, stabilizer, stack of tasks [M18 3.8].
/// Ticks of 5 ms; deterministic, no allocation after the first tick. Unusable parts of a wish or of
/// the sensors (NaN, wrong sizes) are left out and reported in `trouble`.
class Walker {
 public:
  /// The biped outlives it. @throws ConfigError for settings of gait, filter, stabilizer or stack
  /// that contradict each other or do not fit the robot
  Walker(const robot::Biped& biped, const WalkerSettings& settings);
  ~Walker();
  /// Stands in half-sitting with the middle of its feet at `p_W_m`, heading `yaw_rad`.
  void reset(const Eigen::Vector2d& p_W_m, double yaw_rad);
  /// Follows the IMU while nobody balances, once a tick, so that its errors are known before.
  /// @return its attitude, of any heading
  const Eigen::Quaterniond& watch(const Sensors& sensors);
  /// Advances by one tick. The result is valid until the next call.
  const WalkerOutput& step(const WalkerWish& wish, const Sensors& sensors);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::walker
