#pragma once
#include <string>
#include <vector>

#include "common/time.h"
#include "nodes/walker/walk_wish.h"
#include "proto/arm.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::walker {

/// v1.Motion in terms of a robot: finds the robot's joints among the rows of the motion.
class MotionReader {
 public:
  explicit MotionReader(const robot::Biped& biped);

  /// @return empty, or why motions with such rows cannot be followed: one line
  std::string set_rows(const v1::MotionRows& message);
  /// `age_s`: of the message; joints go on by their rates meanwhile. `smooth`: the low-passed
  /// velocities. @return empty, or why it is refused: one line; then `out` is not to be used
  std::string read(const v1::Motion& message, double age_s, bool smooth, MotionWish& out) const;

 private:
  std::string read_upper_body(const v1::Motion& message, double age_s, MotionWish& out) const;

  std::vector<std::string> joints_;  // of the upper body
  std::vector<int> row_;             // of every one of them
  int rows_ = -1;                    // of a motion; -1: not heard of yet
  std::string fault_;                // of the rows
};

/// Into `sensors`; finite, as ports let nothing else pass.
/// @return empty, or why they cannot be used: one line
std::string read_body(const v1::BodySensors& message, Sensors& sensors);
std::string read_joints(const v1::ArmState& message, Sensors& sensors);

void to_proto(const Footprint& footprint, v1::Footprint& out);
void to_proto(const Eigen::Vector3d& point, v1::Vector3& out);
/// All but the state and the hands.
void to_proto(const WalkerOutput& tick, v1::WalkFeedback& out);
void to_proto(const WalkerOutput& tick, v1::WalkBalance& out);
v1::WalkState to_proto(Gait gait);
/// Frames "robot/LINK" in "world".
void to_proto(const robot::Kinematics& kinematics, runtime::Time stamp,
              foxglove::FrameTransforms& out);

}  // namespace mimesis::walker
