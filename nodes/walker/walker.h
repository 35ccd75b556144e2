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
  bool filter = true, stabilize = true;
  FilterSettings filter_settings;
  StabilizerSettings stabilizer;
  UpperBodySettings upper_body;
  StackSettings stack;                 ///< no tasks: walking_stack()
  std::optional<GaitSettings> gait{};  ///< nothing: gait_settings(biped)
};

/// What the robot shall do at a tick.
struct WalkerWish {
  Wish walk;
  Eigen::VectorXd upper_body, upper_body_rate;  ///< Biped::upper_body order; empty: half-sitting
  std::array<TaskGoals::Hand, 2> hand;
};

struct WalkerOutput {
  Eigen::VectorXd q, dq;  ///< set-points of all joints, within their limits
  PatternSample pattern;
  ComState com;  ///< planned, with the filter's shift
  StabilizerCommand stabilizer;
  Eigen::Isometry3d X_WB;  ///< planned pelvis
  std::string trouble;     ///< empty, or one line
  // what was not as wished at this tick
  bool failed = false;   ///< a solve of the pattern or the stack: the last good plan goes on
  bool clipped = false;  ///< the wish was beyond the robot and was cut
  bool limited = false;  ///< a joint limit keeps feet or CoM from their goals
};

/// From a wished walk to joint set-points: pattern, filter, stabilizer, stack of tasks [M18 3.8].
/// Every tick of 5 ms; deterministic, no allocation after the first tick.
class Walker {
 public:
  Walker(const robot::Biped& biped, const WalkerSettings& settings);
  ~Walker();
  /// Stands in half-sitting with the middle of its feet at `p_W_m`, heading `yaw_rad`.
  void reset(const Eigen::Vector2d& p_W_m, double yaw_rad);
  const WalkerOutput& step(const WalkerWish& wish, const Sensors& sensors);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::walker
