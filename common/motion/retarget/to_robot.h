#pragma once
#include "common/motion/retarget/posture_ik.h"
#include "common/motion/retarget/robot_figure.h"
#include "common/motion/retarget/to_body.h"

namespace mimesis::retarget {

/// Over all frames (and both sides).
struct Deviation {
  double rms = 0.0, max = 0.0;
};

/// Difference between a robot's motion and the requested one.
struct RobotReport {
  Deviation foot_m, foot_rad, hand_m, hand_rad;  ///< hand_rad is only wished for
  Deviation chest_rad, head_rad;
  /// joints that reach a limit in some frame
  std::vector<std::string> joints_at_limits;
  int frames_at_limits = 0;                              ///< in which some joint does
  double roughness_before = 0.0, roughness_after = 0.0;  ///< E of roughness()
  double speed_share = 0.0;  ///< largest joint speed as a share of its limit [1]
  std::string fastest_joint;
  // The first step, to the robot's skeleton without limits:
  double scale = 1.0;             ///< length of the legs, robot : person
  double stance_speed_m_s = 0.0;  ///< see stance_speed()
};

/// A motion of a robot. Never outside the joint limits.
struct RobotClip {
  double rate_hz = 0.0;
  std::vector<std::string> joints;       ///< names, as RobotTree::joint_names()
  Eigen::MatrixXd q;                     ///< joints×frames, [rad] or [m]
  Eigen::Matrix3Xd pelvis_position_W_m;  ///< position of the root link
  Eigen::Matrix3Xd pelvis_rotation_rad;  ///< axis-angle in W, without jumps by 2π
  RobotReport report;

  Eigen::Index frames() const { return q.cols(); }
  Posture posture(Eigen::Index frame) const;
};

/// One frame of a robot's goals.
struct FrameGoals {
  std::vector<Goal> exact, wishes;
};

/// Postures for goals frame by frame, each from the one before (or from the start's joints where
/// that comes nearer to goals that are missed), then smoothed.
/// @param start  where the search for the first frame begins; moved into the limits
std::vector<Posture> follow(const robot::RobotTree& tree, const Posture& start,
                            const std::vector<FrameGoals>& goals, RobotReport& report,
                            int smoothing_sweeps = 30);

/// The motion on a robot with joint limits [M18 3.3.2]: to its skeleton without limits first
/// (to_body.h: feet stand still), then posture by posture to its joints (solve()), then
/// smoothed (smooth()). 5 to 10 ms a frame.
/// @throws ConfigError as retarget() to a body, and if the robot lacks a link of the figure
RobotClip retarget(const mocap::BodyClip& recorded, const robot::RobotTree& tree,
                   const RobotFigure& figure, int smoothing_sweeps = 30);

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
