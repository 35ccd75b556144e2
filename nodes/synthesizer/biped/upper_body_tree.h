#pragma once
#include <string>
#include <vector>

#include "common/motion/retarget/robot_figure.h"

namespace mimesis::synthesizer {

/// Joints that are in no leg, in the order of the robot's.
std::vector<std::string> upper_body_joints(const robot::RobotTree& tree,
                                           const retarget::RobotFigure& figure);
/// The robot without its legs: the same root, links and joints of the upper body.
robot::RobotTree upper_body_tree(const robot::RobotTree& tree, const retarget::RobotFigure& figure);

/// The pelvis' origin above the soles in the robot's easy posture [m].
double easy_pelvis_height(const robot::RobotTree& tree, const retarget::RobotFigure& figure);

}  // namespace mimesis::synthesizer
