#pragma once
#include <algorithm>
#include <numbers>
#include <string>

#include "common/model/files.h"
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

  /// `limits` with this or the robot's step_s. @throws ConfigError
  RobotLimits asked() const {
    RobotLimits asked = limits;
    asked.step_s = step_s > 0.0 ? step_s : model::load_biped(description).step_s;
    return asked;
  }
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
  int drawer_seed = 1;           ///< seed of generated trials of the drawer actions [1]
  CharactersSettings character;  ///< its walk.dt_s follows from rate_hz
  RobotParams robot;
  double beat_stale_s = 5.0;  ///< a beat has ended after this time without a message [s]
  double figures_hz = 25.0;   ///< rate of the picture for viewers; 0: none [Hz]
  double gait_stale_s = 0.5;  ///< a crowd command is released after this time without a new one [s]

  void visit(runtime::ParamVisitor& v) {
    constexpr double kFarthest_m = 1e4;
    v("rate_hz", rate_hz, 20.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v.file("model", model, "motion model");
    v("characters", characters, 1, 20000);
    v("style", character.style);
    v.group("start", [this](runtime::ParamVisitor& g) {
      g("arrangement", start.arrangement, {"grid", "row", "circle"});
      g("spacing_m", start.spacing_m, 0.1, 100.0);
      g("x_m", start.centre_W_m.x(), -kFarthest_m, kFarthest_m);
      g("y_m", start.centre_W_m.y(), -kFarthest_m, kFarthest_m);
      g("heading_rad", start.heading_rad, -std::numbers::pi, std::numbers::pi);
      g("walking", character.walking);
      g("spread_phases", start.spread_phases);
    });
    v.group("goal", [this](runtime::ParamVisitor& g) {
      g("kind", goal.kind, {"none", "walk_to", "drawer"});
      g("x_m", goal.x_m, -kFarthest_m, kFarthest_m);
      g("y_m", goal.y_m, -kFarthest_m, kFarthest_m);
      g("object_depth_m", goal.object_depth_m, 0.0, 1.0);
    });
    v("drawer", drawer);
    v("drawer_seed", drawer_seed, 0, 1'000'000'000);
    v("goal_tolerance_m", character.walk.goal_tolerance_m, 0.02, 2.0);
    v("give_up_s", character.walk.give_up_s, 1.0, 600.0);
    v.group("robot", [this](runtime::ParamVisitor& g) {
      RobotLimits& limits = robot.limits;
      g.file("description", robot.description, "biped");
      g("max_forward_m_s", limits.forward_m_s, 0.02, 1.0);
      g("max_left_m_s", limits.left_m_s, 0.0, 0.5);
      g("max_turn_rad_s", limits.turn_rad_s, 0.01, 1.0);
      g("acceleration_m_s2", limits.acceleration_m_s2, 0.02, 10.0);
      g("turn_acceleration_rad_s2", limits.turn_acceleration_rad_s2, 0.02, 10.0);
      g("step_s", robot.step_s, 0.0, 3.0);
      g("stale_s", robot.stale_s, 0.02, 10.0);
    });
    v("beat_stale_s", beat_stale_s, 0.05, 600.0);
    v("gait_stale_s", gait_stale_s, 0.05, 60.0);
    v("figures_hz", figures_hz, 0.0, 100.0);
    v("foot_lock", character.foot_lock);
  }
  /// see run_node
  double robot_rate_hz() const {
    return robot.description.empty() ? 0.0 : model::rate_of_robot(robot.description);
  }
  CharactersSettings character_settings() const {
    CharactersSettings s = character;
    s.walk.dt_s = 1.0 / rate_hz;
    if (robot.description.empty()) return s;
    s.walk.longest_cycle = std::max(s.walk.longest_cycle, 5.0);  // robots step slower than people
    s.foot_lock = false;                                         // robots have feet of their own
    return s;
  }
};

}  // namespace mimesis::synthesizer
