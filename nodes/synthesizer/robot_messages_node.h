#pragma once
#include <string>

#include "nodes/synthesizer/motion_messages_node.h"
#include "nodes/synthesizer/robot_director.h"
#include "proto/walker.pb.h"

namespace mimesis::synthesizer {

/// Why feedback cannot be used; empty if it can.
std::string fault(const v1::WalkFeedback& feedback);
/// The feedback has no fault.
RobotFeedback to_feedback(const v1::WalkFeedback& message);

/// Why it cannot be used; empty if it can.
std::string fault(const v1::DrawerState& drawer);
/// The message has no fault.
DrawerSeen to_seen(const v1::DrawerState& message);

/// The motion of a robot, but for style.
void to_proto(const RobotMotion& motion, const LimitedMotion& limited, v1::Motion& message);

}  // namespace mimesis::synthesizer
