#pragma once
#include <string>

#include "common/testing/temporary_folder.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer::testing {

/// Three styles of synthetic walkers with the same sources: "walk" (1 m/s, 1 s), "slow" (0.5 m/s,
/// 1.3 s), "brisk" (1.2 m/s, 0.9 s). `turns`: "walk" has turns of ±0.8 rad/s too.
inline motion::MotionModel three_styles(bool turns = false) {
  constexpr int kHarmonics = 8;  // harmonics used, of 24: enough to walk, and quick to load
  motion::MotionModel model = walking_model({.harmonics = kHarmonics});
  const auto add = [&model](const char* style, WalkSettings settings) {
    settings.harmonics = kHarmonics;
    motion::Pattern pattern = walking_model(settings).patterns.front();
    pattern.trial.style = style;
    model.patterns.push_back(pattern);
  };
  if (turns) {
    add("walk", {.turn_rad_s = 0.8});
    add("walk", {.turn_rad_s = -0.8});
  }
  add("slow", {.speed_m_s = 0.5, .duration_s = 1.3});
  add("brisk", {.speed_m_s = 1.2, .duration_s = 0.9});
  return model;
}

/// A model for a robot: rows are joints, nothing moves a pelvis.
inline motion::MotionModel robot_model() {
  motion::MotionModel model = random_model(3);
  model.name = "robot";
  for (std::size_t r = 0; r < model.rows.size(); ++r) model.rows[r] = "joint_" + std::to_string(r);
  return model;
}

/// A synthetic model as a file, until the end of the test program.
class ModelFile {
 public:
  explicit ModelFile(motion::MotionModel model) {
    model.name = "three";
    motion::save_motion_model(model, path());
  }

  std::string path() const { return (folder_ / "three.motion.json").string(); }
  std::string folder() const { return folder_.string(); }

 private:
  mimesis::testing::TemporaryFolder folder_;
};

}  // namespace mimesis::synthesizer::testing
