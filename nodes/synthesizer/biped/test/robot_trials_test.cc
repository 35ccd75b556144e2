#include "nodes/synthesizer/biped/robot_trials.h"

#include <gtest/gtest.h>

#include <chrono>

#include "nodes/synthesizer/drawer/action_maps.h"

namespace mimesis::synthesizer {
namespace {
TEST(X, Y) {
  auto now = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
  };
  const auto tree = robot::read_urdf(MIMESIS_SOURCE_DIR "/models/biped.urdf");
  double t0 = now();
  RobotTrialReport rep;
  const auto data = generate_robot_data(tree, retarget::biped_figure(), robot_drawer(), {}, &rep);
  printf("gen %.2f s hand %.4f speed %.2f %s\n", now() - t0, rep.hand_error_m, rep.speed_share,
         rep.fastest_joint.c_str());
  for (auto [a, b] : {std::pair{3, 2}, {4, 3}, {5, 4}}) {
    t0 = now();
    auto m = learn_drawer_model(data, {a, b});
    printf("learn %d+%d %.2f s Q2 %.5f first %.5f\n", a, b, now() - t0, m.quality_squared,
           m.first_quality_squared);
    t0 = now();
    ActionMaps maps(m);
    printf("maps %.2f s\n", now() - t0);
    auto p = maps.at(kNormalStep, {.length_m = 0.53, .duration_s = 1.6});
    printf("v mean %.4f (%.4f)\n", p.mean_rad[18], 0.53 / 1.6);
  }
}
}  // namespace
}  // namespace mimesis::synthesizer
