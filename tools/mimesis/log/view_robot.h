#pragma once
#include <optional>
#include <vector>

#include "common/kin/arm.h"
#include "proto/arm.pb.h"
#include "tools/mimesis/log/view_drawing.h"

namespace mimesis::tool {

/// Draws the arm and its hand where their states say they are: shapes on view/robot, poses on
/// view/robot_frames at 25 Hz. Every message on view/robot is whole, so that a viewer may seek.
class RobotView {
 public:
  explicit RobotView(kin::ArmModel arm) : arm_(std::move(arm)) {}

  // False: the state is not finite, or of an arm with another number of joints.
  bool see(const v1::ArmState& state, const Draw& draw);
  bool see(const v1::HandState& state, const Draw& draw);

 private:
  kin::ArmModel arm_;
  std::vector<Eigen::Isometry3d> X_;
  std::optional<std::chrono::nanoseconds> due_;  ///< of the next poses; none before the first
  std::optional<double> closure_;                ///< as drawn last
};

}  // namespace mimesis::tool
