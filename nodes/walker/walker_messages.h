#pragma once
#include <string>
#include <vector>

#include "common/model/messages.h"
#include "common/time.h"
#include "nodes/walker/walk_wish.h"
#include "proto/bridge.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::walker {

/// Reads v1.Motion for a robot: finds the robot's joints among the rows of the motion.
class MotionReader {
 public:
  explicit MotionReader(const robot::Biped& biped);

  /// @return empty, or one line: why motions with such rows cannot be followed
  std::string set_rows(const v1::MotionRows& message);
  /// `age_s`: age of the message; joints are extrapolated by their rates. `smooth`: use the
  /// low-passed velocities. @return empty, or one line: why it is refused; then `out` must not be
  /// used
  std::string read(const v1::Motion& message, double age_s, bool smooth, MotionWish& out) const;

 private:
  std::string read_upper_body(const v1::Motion& message, double age_s, MotionWish& out) const;

  std::vector<std::string> joints_;  // joints of the upper body
  std::vector<int> row_;             // row of each joint
  int rows_ = -1;                    // number of rows of a motion; -1: not known yet
  std::string fault_;                // fault of the rows
};

/// Fill `sensors`. Values are finite, because ports reject others.
/// @return empty, or one line: why they cannot be used
std::string read_body(const v1::BodySensors& message, Sensors& sensors);
std::string read_joints(const v1::JointState& message, Sensors& sensors);

void to_proto(const Footprint& footprint, v1::Footprint& out);
using model::to_proto;  // places
void to_proto(const Eigen::Quaterniond& turn, v1::Quaternion& out);
/// Fills all fields except the state, hands and head.
void to_proto(const WalkerOutput& tick, v1::WalkFeedback& out);
void to_proto(const WalkerOutput& tick, v1::WalkBalance& out);
v1::WalkState to_proto(Gait gait);
/// Writes the frames "robot/LINK" in "world".
void to_proto(const robot::Kinematics& kinematics, runtime::Time stamp,
              foxglove::FrameTransforms& out);

}  // namespace mimesis::walker
