#include "nodes/synthesizer/synthesizer_params_node.h"

#include <algorithm>
#include <numbers>

#include "common/model/files.h"

namespace mimesis::synthesizer {
namespace {
constexpr double kFarthest_m = 1e4;
}  // namespace

void StartParams::visit(runtime::ParamVisitor& v) {
  v("arrangement", arrangement, {"grid", "row", "circle"});
  v("spacing_m", spacing_m, 0.1, 100.0);
  v("x_m", x_m, -kFarthest_m, kFarthest_m);
  v("y_m", y_m, -kFarthest_m, kFarthest_m);
  v("heading_rad", heading_rad, -std::numbers::pi, std::numbers::pi);
  v("walking", walking);
  v("spread_phases", spread_phases);
}

void FirstGoalParams::visit(runtime::ParamVisitor& v) {
  v("kind", kind, {"none", "walk_to", "drawer"});
  v("x_m", x_m, -kFarthest_m, kFarthest_m);
  v("y_m", y_m, -kFarthest_m, kFarthest_m);
  v("object_depth_m", object_depth_m, 0.0, 1.0);
}

void RobotParams::visit(runtime::ParamVisitor& v) {
  v("description", description);
  v("max_forward_m_s", limits.forward_m_s, 0.02, 1.0);
  v("max_left_m_s", limits.left_m_s, 0.0, 0.5);
  v("max_turn_rad_s", limits.turn_rad_s, 0.01, 1.0);
  v("acceleration_m_s2", limits.acceleration_m_s2, 0.02, 10.0);
  v("turn_acceleration_rad_s2", limits.turn_acceleration_rad_s2, 0.02, 10.0);
  v("step_s", step_s, 0.0, 3.0);
  v("stale_s", stale_s, 0.02, 10.0);
}

RobotLimits RobotParams::asked() const {
  RobotLimits asked = limits;
  asked.step_s = step_s > 0.0 ? step_s : model::load_biped(description).step_s;
  return asked;
}

void SynthesizerParams::visit(runtime::ParamVisitor& v) {
  v("rate_hz", rate_hz, 20.0, 1000.0);
  v("offset_s", offset_s, 0.0, 1.0);
  v("model", model);
  v("characters", characters, 1, 20000);
  v("style", style);
  v.group("start", [this](runtime::ParamVisitor& g) { start.visit(g); });
  v.group("goal", [this](runtime::ParamVisitor& g) { goal.visit(g); });
  v("drawer", drawer);
  v("drawer_seed", drawer_seed, 0, 1'000'000'000);
  v("style_beta", walk.style_beta, 0.01, 1.0);
  v("turn_gain_1_s", walk.turn_gain_1_s, 0.1, 10.0);
  v("turn_max_rad_s", walk.turn_max_rad_s, 0.05, 3.0);
  v("goal_tolerance_m", walk.goal_tolerance_m, 0.02, 2.0);
  v("longest_step", walk.longest_step, 0.5, 1.5);
  v("shortest_cycle", walk.shortest_cycle, 0.3, 1.0);
  v("longest_cycle", walk.longest_cycle, 1.0, 5.0);
  v("give_up_s", walk.give_up_s, 1.0, 600.0);
  v.group("robot", [this](runtime::ParamVisitor& g) { robot.visit(g); });
  v("beat_alpha_1_s", beat_alpha_1_s, 0.0, 100.0);
  v("crowd_alpha_1_s", crowd_alpha_1_s, 0.0, 100.0);
  v("beat_stale_s", beat_stale_s, 0.05, 600.0);
  v("gait_stale_s", gait_stale_s, 0.05, 60.0);
  v("foot_lock", foot_lock);
}

double SynthesizerParams::robot_rate_hz() const {
  return robot.description.empty() ? 0.0 : model::rate_of_robot(robot.description);
}

CharactersSettings SynthesizerParams::character_settings() const {
  CharactersSettings s;
  s.walk = walk;
  s.walk.dt_s = 1.0 / rate_hz;
  // robots step slower than the people whose motion they have
  if (!robot.description.empty()) s.walk.longest_cycle = std::max(s.walk.longest_cycle, 5.0);
  s.style = style;
  s.walking = start.walking;
  s.foot_lock = foot_lock && robot.description.empty();  // a robot has feet of its own
  s.beat_alpha_1_s = beat_alpha_1_s;
  s.crowd_alpha_1_s = crowd_alpha_1_s;
  return s;
}

Formation SynthesizerParams::formation() const {
  Formation f;
  f.arrangement = start.arrangement == "row"      ? Arrangement::row
                  : start.arrangement == "circle" ? Arrangement::circle
                                                  : Arrangement::grid;
  f.spacing_m = start.spacing_m;
  f.centre_W_m = {start.x_m, start.y_m};
  f.heading_rad = start.heading_rad;
  f.spread_phases = start.spread_phases;
  return f;
}

}  // namespace mimesis::synthesizer
