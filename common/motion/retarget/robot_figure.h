#pragma once
#include <array>
#include <map>
#include <string>

#include "common/motion/mocap/body.h"
#include "common/motion/retarget/posture_ik.h"
#include "common/robot/biped.h"

namespace mimesis::retarget {

/// Which parts of a robot correspond to a person's: names of links. The origins of those named
/// after joints are joint centres. Frames of all these links are parallel in the zero posture: x
/// forward, y left, z up, arms hanging.
struct RobotFigure {
  std::string pelvis;  ///< the root
  std::string spine, chest, neck, head;
  std::array<std::string, 2> hip, knee, ankle, shoulder, elbow, wrist;  ///< left, right
  /// In the frames of ankle and wrist links (which the last joint of the limb moves) [m].
  std::array<Eigen::Vector3d, 2> heel_m{}, toe_m{}, hand_m{};
  double head_height_m = 0.2;               ///< from the head's joint to its top
  std::map<std::string, double> start_rad;  ///< joints of an easy posture; others 0
};

/// Figure of a robot's description: hips, knees and ankles are the third, fourth and last link of a
/// leg, the spine is the first link that moves below the trunk, which is the chest, the neck the
/// first one above it; arms as robot::arm_of(). The easy posture is half-sitting, except for links
/// on the hands.
/// @throws ConfigError that names the missing part, or a link that is turned in the zero posture
RobotFigure figure_of(const robot::Biped& biped);

/// The robot's skeleton without its limits: a person with the robot's segments [M18 3.3.2, fig.
/// 3.8]. @throws ConfigError if the robot lacks a link
mocap::Body robot_body(const robot::RobotTree& tree, const RobotFigure& figure);

/// Where the joint centres of robot_body() are in a posture: what films draw. Looks up names.
mocap::BodyPose body_pose(const robot::Kinematics& kinematics, const RobotFigure& figure);

/// Links and goals of one robot, looked up once.
class RobotGoals {
 public:
  /// @throws ConfigError if the robot lacks a link or a joint of the easy posture
  RobotGoals(const robot::RobotTree& tree, const RobotFigure& figure);

  /// Feet and places of hands, in this order: left foot, right foot, left hand, right hand. Feet
  /// weigh ten times as much where limits forbid both.
  std::vector<Goal> exact(const mocap::BodyPose& pose) const;
  /// Pelvis, chest, head, then knees, elbows and the hands' orientation.
  std::vector<Goal> wishes(const mocap::BodyPose& pose) const;
  /// The easy posture with the pelvis of the pose.
  Posture start(const mocap::BodyPose& pose) const;

 private:
  Eigen::VectorXd start_;
  int pelvis_, chest_, head_;
  std::array<int, 2> ankle_, wrist_, elbow_, knee_;
  std::array<Eigen::Vector3d, 2> sole_m_, hand_m_;
};

}  // namespace mimesis::retarget
