#pragma once
#include <string>

#include "common/runtime/params.h"
#include "nodes/synthesizer/character/characters.h"
#include "nodes/synthesizer/robot/robot_walk.h"

namespace mimesis::synthesizer {

/// Where characters stand at the start.
struct StartParams {
  std::string arrangement = "grid";  ///< grid, row or circle
  double spacing_m = 1.2;            ///< between neighbours [m]
  double x_m = 0.0, y_m = 0.0;       ///< middle of the formation in W [m]
  double heading_rad = 0.0;          ///< in W, + to the left [rad]
  bool walking = false;              ///< from the first moment; else they stand until told
  bool spread_phases = false;        ///< else all begin at left heel strike

  void visit(runtime::ParamVisitor& v);
};

/// What is to be done before the first message on port `goal`.
struct FirstGoalParams {
  std::string kind = "none";    ///< none, walk_to, drawer
  double x_m = 0.0, y_m = 0.0;  ///< in W [m]
  double object_depth_m = 0.2;  ///< of drawer: behind its front [m]

  void visit(runtime::ParamVisitor& v);
};

/// The motion is one that a walking robot shall follow.
struct RobotParams {
  std::string description;  ///< of the robot, such as biped.yaml; empty: no robot
  RobotLimits limits;       ///< what it can be asked for
  double step_s = 0.0;      ///< of one step; 0: the robot's own [s]
  double stale_s = 0.25;    ///< feedback not heard for so long is none [s]

  void visit(runtime::ParamVisitor& v);
  RobotLimits asked() const;  ///< `limits` with this or the robot's step_s. @throws ConfigError
};

struct SynthesizerParams {
  double rate_hz = 200.0;                  ///< of the motion: the robot's, if there is one [Hz]
  double offset_s = 0.0;                   ///< of the first step within the period [s]
  std::string model = "walk.motion.json";  ///< file of the motion model
  int characters = 1;                      ///< [1]
  std::string style;                       ///< at the start; empty: the model's first
  StartParams start;
  FirstGoalParams goal;
  bool drawer = false;  ///< learn the actions for drawers at the start (some seconds)
  int drawer_seed = 1;  ///< of the trials they are learned from [1]
  WalkSettings walk;    ///< its dt_s follows from rate_hz
  RobotParams robot;
  double beat_alpha_1_s = 2.0;   ///< coupling to the beat [M18 eq. 3.18] [1/s]
  double crowd_alpha_1_s = 2.0;  ///< and to phases of crowd commands [1/s]
  double beat_stale_s = 5.0;     ///< a beat not heard for so long has ended [s]
  double gait_stale_s = 0.5;     ///< a crowd command not heard for so long is released [s]
  bool foot_lock = true;         ///< standing feet stay where they are

  void visit(runtime::ParamVisitor& v);
  double robot_rate_hz() const;  ///< see run_node
  CharactersSettings character_settings() const;
  Formation formation() const;
};

}  // namespace mimesis::synthesizer
