#pragma once
#include <optional>

#include "nodes/synthesizer/biped/robot_feedback.h"

namespace mimesis::synthesizer {

/// Landings that are wished: of the next swing foot and the one after it.
using Landings = std::array<std::optional<SolePrint>, 2>;

/// A robot that walks exactly as it is wished: what is believed while none says where it is. Shifts
/// its weight first, then a step every `step_s`, as long as landings are wished; the middle of the
/// feet carries the pelvis.
class BelievedWalker {
 public:
  BelievedWalker(double step_s, double shift_s, double dt_s)
      : step_s_(step_s), shift_s_(shift_s), dt_s_(dt_s) {}

  /// It goes on from here.
  void place(const RobotFeedback& robot);
  /// @param walk  steps are wished; else it ends with the step under way
  void step(const Landings& landing, bool walk);
  const RobotFeedback& feedback() const { return robot_; }

 private:
  void land();

  double step_s_, shift_s_, dt_s_;
  RobotFeedback robot_;
  Eigen::Vector2d lifted_ = Eigen::Vector2d::Zero();  // where the swing foot left
};

/// Two feet side by side, `distance_m` apart, heading the way; pelvis above their middle.
RobotFeedback standing_robot(const Eigen::Vector2d& p_W_m, double heading_rad, double distance_m,
                             double pelvis_height_m);

}  // namespace mimesis::synthesizer
