#pragma once
#include <array>
#include <string>
#include <vector>

#include "common/robot/robot_tree.h"

namespace mimesis::robot {

enum Side { kLeft, kRight };
inline constexpr std::array kSides = {kLeft, kRight};
inline Side other(Side side) { return side == kLeft ? kRight : kLeft; }
/// +1 for the left, −1 for the right: y of the foot in the pelvis.
inline double sign(Side side) { return side == kLeft ? 1.0 : -1.0; }

/// What a robot's joints can do of a walk; 0: what the length of its legs gives.
struct GaitMost {
  double step_height_m = 0.0;  ///< of the sole at the top of a swing
  double most_forward_m_s = 0.0, most_sideways_m_s = 0.0, most_turn_rad_s = 0.0;
};

/// Names and figures that make a robot a biped, as in its file (model::load_biped).
struct BipedNames {
  std::array<std::string, 2> sole;          ///< links, left and right: frame S on the ground
  std::array<std::string, 2> hand;          ///< links between the fingers; empty: none
  std::array<std::string, 2> gripper = {};  ///< joints that close the hands; empty: none
  std::array<double, 2> gripper_closed_rad{};
  std::string trunk;      ///< link that the upper body hangs on
  std::string head = {};  ///< link; empty: none
  std::string imu;        ///< link that carries the inertial measurement unit
  double sole_back_m = 0.0, sole_front_m = 0.0;   ///< x in S; back < 0 < front
  double sole_inner_m = 0.0, sole_outer_m = 0.0;  ///< distance of the edges from S's x axis, > 0
  std::vector<std::pair<std::string, double>> half_sitting;  ///< joint, [rad]; others 0
  double step_s = 0.8;                                       ///< duration of one step of a walk
  GaitMost gait = {};
};

/// Joints of a leg by their place in Biped::Leg::dof: three in the hip, the knee, two in the ankle.
enum LegJoint : std::size_t { kHipFirst, kHipLast = 2, kKnee = 3, kAnkleFirst = 4, kAnkleLast = 5 };

/// A robot with two legs of six joints. S: frame of a sole, on the ground below the ankle, x
/// forward, z up. The root link is the pelvis.
struct Biped {
  struct Leg {
    int sole = -1;              ///< link
    int foot = -1;              ///< link that the last joint of the leg moves; carries the sole
    std::array<int, 6> dof{};   ///< from the pelvis to the foot, see LegJoint
    Eigen::Vector3d ankle_S_m;  ///< where the last two axes meet or are nearest, in S
    /// Centre of the hip, where its axes meet or are nearest, in the link that its last joint
    /// moves; and of the ankle, in the link that its first joint moves. Within 1 µm of the frame's
    /// origin: 0.
    Eigen::Vector3d hip_T_m = Eigen::Vector3d::Zero(), ankle_A_m = Eigen::Vector3d::Zero();
    Eigen::Vector2d min_S_m, max_S_m;  ///< rectangle of the sole
  };
  RobotTree tree;
  std::array<Leg, 2> leg;
  /// A hand counts as closed when abs(angle) of its joint exceeds this, with the same sign.
  struct Gripper {
    int dof = -1;  ///< -1: none, the hand is always closed
    double closed_rad = 0.0;
  };
  std::array<int, 2> hand{-1, -1};      ///< links
  int trunk = -1, imu = -1;             ///< links
  std::vector<int> upper_body;          ///< joints that are in no leg
  Eigen::VectorXd half_sitting;         ///< dof [rad]; soles level and side by side
  Eigen::Isometry3d X_WB_half_sitting;  ///< pelvis, soles at z = 0, their middle at the origin
  double com_height_m = 0.0;            ///< height of the half-sitting robot's CoM above the soles
  double feet_distance_m = 0.0;         ///< between the soles' origins, half-sitting
  std::array<Gripper, 2> gripper{};     ///< grippers of the hands
  int head = -1;                        ///< link; -1: none
  double step_s = 0.8;                  ///< duration of one step of a walk
  GaitMost gait = {};
};

/// @throws ConfigError that names robot and joint or link: a leg has not six revolute joints, does
///         not carry its sole, half-sitting breaks a limit or does not put both soles on one plane.
Biped make_biped(RobotTree tree, const BipedNames& names);

/// Distance from hip to knee plus distance from knee to ankle, in the zero posture [m]; the knee:
/// the origin of its joint.
double leg_length_m(const Biped& biped);

/// Links that joints move, from link `above` (excluded) down to `link`; all of them if `above` does
/// not carry it.
std::vector<int> moved_links(const RobotTree& tree, int above, int link);

/// The joints' centres of an arm: the third joint from the trunk on (where the axes of a shoulder
/// meet), the fourth, and the last one before the hand. Links.
struct Arm {
  int shoulder = -1, elbow = -1, wrist = -1;
};
/// @throws ConfigError that names the hand: there is none, or fewer than five joints carry it
Arm arm_of(const Biped& biped, Side side);

}  // namespace mimesis::robot
