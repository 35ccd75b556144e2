// `mimesis motion`: the real program on a recorded run, a shipped model and recordings; what it
// writes is opened by a foreign reader.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/clip_writers.h"
#include "common/motion/mocap/test/foreign_scene.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "proto/foxglove/scene.pb.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

const std::string kSource = MIMESIS_SOURCE_DIR;
const std::string kRun = kSource + "/tests/replay/logs/synthesizer.mcap";
const std::string kWalk = kSource + "/models/walk.motion.json";

class Motion : public testing::VerbTest {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  int run(std::vector<std::string> words) {
    words.insert(words.begin(), "motion");
    return call(words);
  }
  void refuses(const std::vector<std::string>& words, const std::string& text) {
    EXPECT_EQ(run(words), 2) << output_;
    EXPECT_NE(errors_.find(text), std::string::npos) << errors_;
    EXPECT_EQ(std::ranges::count(errors_, '\n'), 1) << errors_;
  }
  testing::TemporaryFolder folder_;
};

/// A node's place in W [m].
Eigen::Vector3d place(const mocap::ForeignScene& scene, const char* node, unsigned frame,
                      double unit_m) {
  const Eigen::Vector3d p = unit_m * scene.place(node, frame);
  return {p.z(), p.x(), p.y()};
}

TEST_F(Motion, FramesBetweenTheRunsAreInTheirMiddle) {
  for (const char* rate_hz : {"50", "100"}) {
    const std::string file = path(std::string(rate_hz) + ".glb");
    ASSERT_EQ(run({"export", kRun, "--gltf", file, "--rate-hz", rate_hz}), 0) << errors_;
  }
  const mocap::ForeignScene runs(path("50.glb")), twice(path("100.glb"));
  const auto heading_rad = [](const mocap::ForeignScene& scene, unsigned frame) {
    const Eigen::Vector3d v =
        place(scene, "LeftUpLeg", frame, 1.0) - place(scene, "RightUpLeg", frame, 1.0);
    return std::atan2(v.y(), v.x());
  };
  double largest_rad = 0.0;
  for (unsigned t = 0; t + 1 < runs.frames(); ++t) {
    const double from = heading_rad(runs, t), change = heading_rad(runs, t + 1) - from;
    const double middle = heading_rad(twice, 2 * t + 1);
    EXPECT_NEAR(std::remainder(middle - from, 2.0 * M_PI), 0.5 * std::remainder(change, 2.0 * M_PI),
                5e-4)
        << t;
    largest_rad = std::max(largest_rad, std::abs(std::remainder(change, 2.0 * M_PI)));
  }
  EXPECT_GT(largest_rad, 0.01) << "it turns";
}

/// The node drew its figure in the run, at half the rate of its motion: bones are where they were.
TEST_F(Motion, AFigureOfARunLeavesAsItWasSeen) {
  ASSERT_EQ(run({"export", kRun, "--bvh", path("run.bvh"), "--gltf", path("run.glb"), "--json"}), 0)
      << errors_;
  const json report = json::parse(output_);
  EXPECT_EQ(report["frames"], 300);
  EXPECT_DOUBLE_EQ(report["rate_hz"], 50.0);
  const mocap::ForeignScene bvh(path("run.bvh")), glb(path("run.glb"));
  ASSERT_EQ(bvh.frames(), 300U);
  ASSERT_EQ(glb.frames(), 300U);
  const std::vector<OpenLog> logs = open_logs({kRun});
  unsigned frame = 0;
  int drawn = 0;
  scan_logs(logs, {}, "", [&](const Item& item) {
    if (item.channel->topic == "synthesizer/motion") frame = item.message->sequence - 1;
    if (item.channel->topic != "synthesizer/figures") return;
    foxglove::SceneUpdate update;
    ASSERT_TRUE(parse(item, update));
    if (++drawn % 10 != 0) return;
    for (const auto& [from, to] :
         {std::pair("LeftLeg", "LeftFoot"), std::pair("RightArm", "RightForeArm"),
          std::pair("LeftUpLeg", "LeftLeg"), std::pair("Neck", "Head")}) {
      for (const auto& [scene, unit_m] : {std::pair(&bvh, 0.01), std::pair(&glb, 1.0)}) {
        const Eigen::Vector3d middle =
            0.5 * (place(*scene, from, frame, unit_m) + place(*scene, to, frame, unit_m));
        double nearest_m = 1.0;
        for (const auto& rod : update.entities(0).cylinders()) {
          const auto& p = rod.pose().position();
          nearest_m = std::min(nearest_m, (Eigen::Vector3d(p.x(), p.y(), p.z()) - middle).norm());
        }
        EXPECT_LT(nearest_m, 1e-3) << from << " frame " << frame;
      }
    }
  });
  EXPECT_EQ(drawn, 150);
}

TEST_F(Motion, AModelsCycleIsALoop) {
  ASSERT_EQ(run({"export", kWalk, "--style", "brisk", "--in-place", "--bvh", path("brisk.bvh")}), 0)
      << errors_;
  ASSERT_EQ(run({"export", kWalk, "--style", "brisk", "--bvh", path("way.bvh")}), 0) << errors_;
  const mocap::ForeignScene loop(path("brisk.bvh")), way(path("way.bvh"));
  const unsigned frames = loop.frames();
  ASSERT_GT(frames, 40U);
  const auto step_m = [&](const mocap::ForeignScene& scene, unsigned from, unsigned to,
                          const char* joint) {
    return (place(scene, joint, to, 0.01) - place(scene, joint, from, 0.01)).norm();
  };
  for (const char* joint : {"Hips", "Head", "LeftFoot", "RightFoot", "LeftHand"}) {
    double largest_m = 0.0;
    for (unsigned t = 1; t < frames; ++t)
      largest_m = std::max(largest_m, step_m(loop, t - 1, t, joint));
    EXPECT_LT(step_m(loop, frames - 1, 0, joint), 1.1 * largest_m + 1e-4) << joint;
    EXPECT_LT(largest_m, 0.12) << joint;
  }
  // 1.4 m/s along x
  const Eigen::Vector3d gone = place(way, "Hips", frames - 1, 0.01) - place(way, "Hips", 0, 0.01);
  EXPECT_GT(gone.x() / way.time(frames - 1), 1.2);
  EXPECT_LT(std::abs(gone.y()), 0.05);
}

TEST_F(Motion, RecordingsLeaveAndAreShownBesideTheirPrimitives) {
  ASSERT_EQ(run({"export", kRun, "--bvh", path("run.bvh")}), 0) << errors_;
  ASSERT_EQ(run({"export", path("run.bvh"), "--gltf", path("again.glb")}), 0) << errors_;
  EXPECT_EQ(mocap::ForeignScene(path("again.glb")).frames(), 300U);
  ASSERT_EQ(run({"map", path("again.glb")}), 0) << errors_;
  EXPECT_NE(output_.find("lknee: \"LeftLeg\""), std::string::npos) << output_;
  ASSERT_EQ(run({"view", path("run.bvh"), "-k", "3", "-o", path("both.mcap")}), 0) << errors_;
  EXPECT_NE(errors_.find("3 sources: Q = 0.9"), std::string::npos) << errors_;
  std::map<std::string, int> seen;
  scan_logs(open_logs({path("both.mcap")}), {}, "", [&](const Item& item) {
    foxglove::SceneUpdate update;
    ASSERT_TRUE(parse(item, update));
    seen[item.channel->topic] += update.entities(0).cylinders_size() > 0 ? 1 : 0;
  });
  EXPECT_EQ(seen["recorded"], 300);
  EXPECT_GT(seen["resynthesized"], 80);  // its whole gait cycles
}

TEST_F(Motion, WhatCannotLeaveIsNamed) {
  const std::string to = path("a.bvh");
  refuses({"export", kRun}, "say where to: --bvh FILE or --gltf FILE.glb");
  refuses({"export", kRun, "--gltf", path("a.gltf")}, "expected the ending .glb");
  refuses({"export", kRun, "--bvh", to, "--character", "3"},
          "--character 3: synthesizer/motion has one, 0");
  refuses({"export", kRun, "--bvh", to, "--topic", "synthesizer/notion"}, "synthesizer/motion");
  refuses({"export", kSource + "/tests/replay/logs/planner.mcap", "--bvh", to},
          "no mimesis.v1.Motion, expected a topic of a synthesizer's motion");
  refuses({"export", kRun, "--bvh", to, "--model", kSource + "/models/biped_walk.motion.json"},
          "give the model of the run by --model");
  refuses({"export", kWalk, "--bvh", to, "--style", "happy"}, "happy");
  refuses({"export", kRun, "--bvh", to, "--style", "brisk"}, "is no model (NAME.motion.json)");
  refuses({"map", kRun}, "expected .bvh, .amc, .c3d, .glb, .gltf, .fbx or .dae");
  EXPECT_FALSE(fs::exists(to));
  ASSERT_EQ(run({"export", kRun, "--bvh", to}), 0) << errors_;
  refuses({"export", kRun, "--bvh", to}, "is there already; --force replaces it");
  EXPECT_EQ(run({"export", kRun, "--bvh", to, "--force"}), 0) << errors_;
}

}  // namespace
}  // namespace mimesis::tool
