#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <string>
#include <vector>

#include "nodes/synthesizer/robot/biped_sequence.h"
#include "nodes/synthesizer/robot/test/fake_robot.h"
#include "nodes/synthesizer/robot/test/learned_biped.h"

namespace mimesis::synthesizer::testing {

inline const BipedDrawer& drawer() { return biped_drawer(); }

struct Outcome {
  bool done = false;
  std::string refused;
  double time_s = 0.0, final_m = 0.0, reach_error_m = 0.0, most_speed = 0.0, most_rate_jump = 0.0,
         sum_of_q = 0.0, opened_m = 0.0;
  bool stands = false, hands = false;
  int actions = 0;
  std::vector<PlannedAction> history;
  std::vector<SolePrint> landed;
};

struct Scene {
  double front_m = 1.9, depth_m = 0.2;
  FakeRobot::Trouble trouble = {};
  double jump_at_s = -1.0, jump_m = 0.0;
  bool feedback = true, seen = true;
};

inline Outcome play(const Scene& scene) {
  Outcome out;
  FakeRobot walker(scene.trouble);
  FakeDrawer furniture(scene.front_m, scene.depth_m);
  auto sequence =
      BipedDrawerSequence::start(drawer(), {{scene.front_m, 0.0}, scene.depth_m}, walker.now());
  if (!sequence) {
    out.refused = sequence.error().reason;
    return out;
  }
  Eigen::VectorXd before;
  bool jumped = scene.jump_at_s < 0.0;
  const BipedSequenceState* state = &sequence->state();
  for (; out.time_s < 40.0 && !state->done; out.time_s += 0.005) {
    if (!jumped && out.time_s >= scene.jump_at_s) {
      furniture.jump(scene.jump_m);
      jumped = true;
      if (!scene.seen) {
        sequence->set_task({{scene.front_m + scene.jump_m, 0.0}, scene.depth_m});
      }
    }
    state = &sequence->step(scene.feedback ? walker.feedback() : nullptr,
                            scene.seen ? furniture.seen() : nullptr);
    walker.step(*state);
    furniture.step(walker, *state);
    if (before.size() > 0) {
      const Eigen::VectorXd share = state->dq.cwiseAbs().cwiseQuotient(drawer().upper.max_speed());
      out.most_speed = std::max(out.most_speed, share.maxCoeff());
      out.most_rate_jump = std::max(out.most_rate_jump, (state->dq - before).cwiseAbs().maxCoeff());
    }
    before = state->dq;
    out.sum_of_q += state->q.sum();
  }
  out.done = state->done;
  out.opened_m = state->opened_m;
  out.refused = state->refused;
  out.final_m = scene.front_m + (scene.jump_at_s < 0.0 ? 0.0 : scene.jump_m) -
                0.5 * (walker.now().feet[0].p_W_m.x() + walker.now().feet[1].p_W_m.x());
  out.reach_error_m = furniture.reach_error_m;
  out.actions = state->number + 1;
  out.history = sequence->history();
  out.landed = walker.landed;
  out.stands = state->stands && !walker.now().moves();
  out.hands = state->hand[0].has_value() || state->hand[1].has_value();
  return out;
}

}  // namespace mimesis::synthesizer::testing
