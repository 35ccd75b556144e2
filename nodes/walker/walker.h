#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nodes/walker/filter/dynamic_filter.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/stabilizer.h"
#include "nodes/walker/tasks/stack.h"
#include "nodes/walker/upper_body.h"

namespace mimesis::walker {

enum class PatternKind { kNonlinear, kLinear, kPreview };

struct WalkerSettings {
  PatternKind pattern = PatternKind::kNonlinear;
  bool filter = true;     ///< dynamic filter; false: the cart-table's CoM as it is
  bool stabilize = true;  ///< by what is measured; false: by plan alone
  FilterSettings filter_settings;
  StabilizerSettings stabilizer;
  UpperBodySettings upper_body;
  StackSettings stack;                 ///< no tasks: those of walking_stack()
  std::optional<GaitSettings> gait{};  ///< nothing: gait_settings(biped)
};

/// What the robot shall do at a tick.
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
  std::string trouble;     ///< the tick's first in one line; empty: none
  // what was not as wished at this tick
  bool failed = false;   ///< a solve of the pattern or the stack: the last good plan goes on
  bool clipped = false;  ///< the wish was beyond the robot and was cut
  bool limited = false;  ///< a joint limit keeps feet or CoM from their goals
};

/// From a wished walk to joint set-points: pattern, filter, stabilizer, stack of tasks [M18 3.8].
/// Every tick of 5 ms; deterministic, no allocation after the first tick. What it cannot use of a
/// wish or of sensors (NaN, wrong sizes) it leaves out and tells in `trouble`.
class Walker {
 public:
  /// The biped outlives it. @throws ConfigError for a gait, a filter, a stabilizer or a stack that
  /// makes no sense or does not fit the robot
  Walker(const robot::Biped& biped, const WalkerSettings& settings);
  ~Walker();
  /// Stands in half-sitting with the middle of its feet at `p_W_m`, heading `yaw_rad`.
  void reset(const Eigen::Vector2d& p_W_m, double yaw_rad);
  /// One tick on. The result lives until the next call.
  const WalkerOutput& step(const WalkerWish& wish, const Sensors& sensors);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::walker
