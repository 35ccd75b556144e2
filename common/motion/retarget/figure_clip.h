#pragma once
#include "common/motion/retarget/to_robot.h"

namespace mimesis::retarget {

/// A robot's motion as that of its skeleton (robot_body()), whose feet move the pelvis.
struct FigureClip {
  mocap::BodyClip clip;
  /// Distance of the figure's ankles and wrists from the robot's, pelvis in the same place: a
  /// robot's axes need not meet in a point, as those of a ball joint do. Legs are bent so that the
  /// ankles agree; arms keep the directions of the robot's links.
  Deviation ankle_m, wrist_m;
};

/// All links keep their orientation in W, but for thighs and shanks, which change it by what brings
/// the ankles to the robot's. Name and first frame are those of the recording.
/// @throws ConfigError if the robot lacks a link of the figure
FigureClip figure_clip(const RobotClip& motion, const mocap::BodyClip& recorded,
                       const robot::RobotTree& tree, const RobotFigure& figure);

}  // namespace mimesis::retarget
