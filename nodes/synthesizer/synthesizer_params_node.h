#pragma once
#include <string>

#include "common/runtime/params.h"
#include "nodes/synthesizer/character/characters.h"
#include "nodes/synthesizer/robot/robot_walk.h"

namespace mimesis::synthesizer {

/// Goal that is set before the first message on port `goal`.
struct FirstGoalParams {
  std::string kind = "none";    ///< kind of goal: none, walk_to, drawer
  double x_m = 0.0, y_m = 0.0;  ///< place in W [m]
  double object_depth_m = 0.2;  ///< distance of a drawer's object behind its front [m]
};

/// Settings of motion for a walking robot.
struct RobotParams {
  std::string description;  ///< model file of the robot, such as biped.yaml; empty: no robot
  RobotLimits limits;       ///< limits of the requests
  double step_s = 0.0;      ///< duration of one step; 0: the robot's own [s]
  double stale_s = 0.25;    ///< older feedback is ignored [s]

  RobotLimits asked() const;  ///< `limits` with this or the robot's step_s. @throws ConfigError
};

struct SynthesizerParams {
  /// rate of the motion: the robot's, if there is one [Hz]
  double rate_hz = 200.0;
  double offset_s = 0.0;                   ///< time of the first step within the period [s]
  std::string model = "walk.motion.json";  ///< file of the motion model
  int characters = 1;                      ///< number of characters [1]
  Formation start;                         ///< where characters stand
  FirstGoalParams goal;
  bool drawer = false;           ///< learns the actions for drawers at the start (some seconds)
  int drawer_seed = 1;           ///< seed of the trials of the drawer actions [1]
  CharactersSettings character;  ///< its walk.dt_s follows from rate_hz
  RobotParams robot;
  double beat_stale_s = 5.0;  ///< a beat has ended after this time without a message [s]
  double gait_stale_s = 0.5;  ///< a crowd command is released after this time without a new one [s]

  void visit(runtime::ParamVisitor& v);
  double robot_rate_hz() const;  ///< see run_node
  CharactersSettings character_settings() const;
};

}  // namespace mimesis::synthesizer
