#include "nodes/synthesizer/biped/biped_sequence.h"

#include <gtest/gtest.h>

#include "nodes/synthesizer/biped/test/fake_walker.h"

namespace mimesis::synthesizer {
namespace {

using testing::FakeDrawer;
using testing::FakeWalker;

const BipedDrawer& drawer() {
  static const BipedDrawer learned = make_biped_drawer(
      robot::read_urdf(MIMESIS_SOURCE_DIR "/models/biped.urdf"), retarget::biped_figure());
  return learned;
}

struct Outcome {
  bool done = false;
  std::string refused;
  double time_s = 0.0, final_m = 0.0, reach_error_m = 0.0, most_speed = 0.0, most_jerk = 0.0;
  int actions = 0;
  std::vector<PlannedAction> history;
  std::vector<SolePrint> landed;
  double planned_error_m = 0.0;
};

struct Scene {
  double front_m = 1.9, depth_m = 0.2;
  FakeWalker::Trouble trouble;
  double jump_at_s = -1.0, jump_m = 0.0;
  bool feedback = true, seen = true;
};

Outcome play(const Scene& scene, bool print = false) {
  Outcome out;
  FakeWalker walker(scene.trouble);
  FakeDrawer furniture(scene.front_m, scene.depth_m);
  auto sequence =
      BipedDrawerSequence::start(drawer(), {{scene.front_m, 0.0}, scene.depth_m}, walker.now());
  if (!sequence) {
    out.refused = sequence.error().reason;
    return out;
  }
  Eigen::VectorXd before;
  int number = -1;
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
      out.most_jerk = std::max(out.most_jerk, (state->dq - before).cwiseAbs().maxCoeff());
    }
    before = state->dq;
    if (print && state->number != number) {
      std::printf("%.2f s: action %d:", out.time_s, state->action);
      for (const auto& a : sequence->plan()) std::printf(" %d/%.3f", a.action, a.length_m);
      std::printf("  to go %.3f; %s\n", state->distance_m, state->refused.c_str());
      number = state->number;
    }
  }
  out.done = state->done;
  out.refused = state->refused;
  out.final_m = scene.front_m + (scene.jump_at_s < 0.0 ? 0.0 : scene.jump_m) -
                0.5 * (walker.now().feet[0].p_W_m.x() + walker.now().feet[1].p_W_m.x());
  out.reach_error_m = furniture.reach_error_m;
  out.actions = state->number + 1;
  out.history = sequence->history();
  out.landed = walker.landed;
  return out;
}

TEST(BipedSequence, Shown) {
  for (double front : {0.5, 0.6, 0.9, 1.2, 1.5, 1.7, 1.9, 2.4, 3.0}) {
    Scene s;
    s.front_m = front;
    const Outcome o = play(s);
    std::printf("front %.2f: done %d %.2f s final %.3f reach %.4f speed %.2f jerk %.3f '%s'\n",
                front, o.done, o.time_s, o.final_m, o.reach_error_m, o.most_speed, o.most_jerk,
                o.refused.c_str());
  }
  for (double at = 0.0; at < 9.0; at += 0.4) {
    for (double by : {-0.5, -0.2, 0.1, 0.3, 0.8}) {
      Scene s;
      s.front_m = 1.7;
      s.jump_at_s = at;
      s.jump_m = by;
      const Outcome o = play(s);
      std::printf(
          "jump at %.1f by %.1f: done %d %.2f s final %.3f reach %.4f speed %.2f jerk %.3f '%s'\n",
          at, by, o.done, o.time_s, o.final_m, o.reach_error_m, o.most_speed, o.most_jerk,
          o.refused.c_str());
    }
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
