#pragma once
#include <string>
#include <vector>

#include "common/motion/retarget/robot_figure.h"
#include "common/robot/biped.h"
#include "nodes/synthesizer/robot/step_plan.h"
#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {

/// The robot without its legs: the same root, links and joints of the upper body.
robot::RobotTree upper_body_tree(const robot::RobotTree& tree, const retarget::RobotFigure& figure);

/// The pelvis' origin above the soles in the robot's easy posture [m].
double easy_pelvis_height(const robot::RobotTree& tree, const retarget::RobotFigure& figure);

/// Factors of the pelvis' velocity in actions 1 and 2.
using Paces = std::array<double, 2>;

/// Training data of a robot's drawer task. Defaults: biped.urdf, two steps of 0.8 s an action.
/// Lengths are chosen so that the fastest trials reach the robot's limit of walking [M18 3.8.4].
struct RobotTrialSettings {
  std::uint64_t seed = 1;
  int trials = 10;
  double least_normal_m = 0.421, most_normal_m = 0.467;      ///< lengths of action 1, at pace 1
  double least_reaching_m = 0.204, most_reaching_m = 0.299;  ///< lengths of action 2
  double least_reach_m = 0.663, most_reach_m = 0.755;        ///< pelvis to object, drawer closed
  double least_depth_m = 0.124, most_depth_m = 0.273;        ///< object behind the front
  double cycle_s = 1.6, standing_s = 2.4;
  /// Further trials of each by scaled velocity of the pelvis, upper body as it was [M18 3.8.3].
  std::vector<double> paces = {0.8, 0.92, 1.2};
  /// Each of them also with different paces of action 1 and 2: a short one after a long one.
  Paces mixed_pace = {1.2, 0.8};
  int samples = 100;  ///< T, of each action
};

/// Demands of the trials on the robot.
struct RobotTrialReport {
  double hand_error_m = 0.0;  ///< largest error of the retargeted hands
  double speed_share = 0.0;   ///< largest joint speed as a share of its limit [1]
  std::string fastest_joint;
};

/// Names of rows: upper-body joints [rad], then these: forward and left [m/s] in the heading frame,
/// turn [rad/s], each the mean from its sample to the next, so that their sum is the travel. They
/// are the wished mean velocity of a step; the walker adds the sway of the pelvis.
inline constexpr std::array<const char*, 3> kVelocityRows = {
    "pelvis.forward_m_s", "pelvis.left_m_s", "pelvis.turn_rad_s"};

/// Rows of a robot's trials: joints of upper_body_tree(), then kVelocityRows.
std::vector<std::string> robot_rows(const robot::Biped& biped);

/// Human-like trials before robot_drawer() of a person with the robot's segments
/// (trials.h), retargeted to its upper body [M18 3.3.2, 3.8.3]: hands exactly, chest, head
/// and elbows as near as the joints allow; the pelvis stays upright at the height of the robot's
/// easy posture. Rows: robot_rows(). Task parameters as kTaskNames.
/// Deterministic.
/// @throws ConfigError for actions of no duration, and as retarget::figure_of(), robot_drawer()
DrawerData generate_robot_data(const robot::Biped& biped, const RobotTrialSettings& settings,
                               RobotTrialReport* report = nullptr);

/// Settings for biped.urdf scaled to a robot's size: furniture and reaches by its arms
/// (robot::drawer_size()), lengths of steps by its legs, but no longer than biped.urdf's: a step
/// takes equally long for all legs, and forces grow with speed.
/// @throws ConfigError as robot::drawer_size()
Drawer robot_drawer(const robot::Biped& biped);
RobotTrialSettings robot_trial_settings(const robot::Biped& biped);
StepPlanSettings robot_step_plan(const robot::Biped& biped);

}  // namespace mimesis::synthesizer
