#pragma once
#include <string>

#include "common/runtime/params.h"
#include "nodes/walker/conduct.h"
#include "nodes/walker/walk_wish.h"

namespace mimesis::walker {

/// Figures of the gait; 0: the robot's own (gait_settings of its description).
struct GaitParams {
  double step_s = 0.0, double_support_s = 0.0, first_double_support_s = 0.0;  ///< [s]
  double step_height_m = 0.0, feet_distance_m = 0.0;                          ///< [m]
  double longest_step_m = 0.0, widest_step_m = 0.0, narrowest_step_m = 0.0;   ///< [m]
  double most_forward_m_s = 0.0, most_sideways_m_s = 0.0;                     ///< [m/s]
  double most_turn_rad_s = 0.0, most_foot_yaw_rad = 0.0;                      ///< [rad/s], [rad]

  void visit(runtime::ParamVisitor& v);
  /// `robot` with the figures that are given. @throws ConfigError if they contradict each other
  GaitSettings over(GaitSettings robot) const;
};

/// Where the robot stands at the start: middle of its feet in W.
struct PlaceParams {
  double x_m = 0.0, y_m = 0.0;  ///< [m]
  double heading_rad = 0.0;     ///< + to the left [rad]

  void visit(runtime::ParamVisitor& v);
};

/// From which postures balance begins, and the way to half-sitting.
struct ReadyParams {
  double near_rad = 0.35;       ///< of every joint from half-sitting, at most [rad]
  double tilt_rad = 0.15;       ///< of the trunk, at most [rad]
  double weight_share = 0.5;    ///< of the robot's weight on its feet, at least [1]
  double start_rad = 0.01;      ///< posture sent to the bridge follows the actual one by [rad]
  double approach_s = 2.0;      ///< way to half-sitting, at least [s]
  double approach_share = 0.1;  ///< of the joints' largest speeds [1]

  void visit(runtime::ParamVisitor& v);
};

struct WalkerParams {
  double rate_hz = 200.0;            ///< of steps: fixed, as gains belong to it [Hz]
  double offset_s = 0.0;             ///< of the first step within the period [s]
  std::string robot = "biped.yaml";  ///< model file
  std::string pattern = "nonlinear";
  bool filter = true;         ///< dynamic filter
  int filter_iterations = 1;  ///< a tick [1]
  bool filter_legs_only = false;
  bool stabilize = true;
  StabilizerSettings stabilizer;
  StackSettings stack;  ///< no tasks: those of walking_stack
  GaitParams gait;
  PlaceParams start;
  ReadyParams ready;
  double motion_stale_s = 0.1;      ///< an older motion has ended: the robot stops [s]
  bool use_smooth_velocity = true;  ///< low-passed velocities of the motion
  double sensors_stale_s = 0.03;    ///< older readings are not used [s]
  ConductSettings conduct;
  WalkWishSettings wish;

  void visit(runtime::ParamVisitor& v);
  /// Settings of the chain for this robot. @throws ConfigError
  WalkerSettings settings(const robot::Biped& biped) const;
};

}  // namespace mimesis::walker
