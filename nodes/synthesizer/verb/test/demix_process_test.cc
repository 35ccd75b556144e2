// `mimesis demix`: the real program on files of trials and clips made here.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "common/math/so3.h"
#include "common/model/files.h"
#include "common/motion/mocap/clip_file.h"
#include "common/motion/mocap/test/shared_folder.h"
#include "common/motion/mocap/test/trials_writer.h"
#include "common/motion/model/motion_model.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "nodes/synthesizer/dynamics/character_batch.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"
#include "nodes/synthesizer/verb/trial_files.h"

namespace mimesis::tool {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// Six trials of two harmonics with tied delays: two sources describe them exactly.
mocap::Trials waves() {
  mocap::Trials set;
  set.rows = {"lhip.y", "rhip.y", "lknee.y"};
  for (int i = 0; i < 6; ++i) {
    mocap::Trial trial;
    trial.clip = "made";
    trial.cycle = i;
    trial.first_frame = 10 * i;
    trial.last_frame = 10 * i + 9;
    trial.duration_s = 1.0 + 0.1 * i;
    set.trials.push_back(trial);
  }
  set.samples.resize(18, 50);
  for (int n = 0; n < 18; ++n) {
    for (int t = 0; t < 50; ++t) {
      const double phi = 2.0 * M_PI * t / 50.0, row = n % 3;
      set.samples(n, t) = 0.1 * n + (0.5 + 0.02 * n) * std::cos(phi - row) +
                          (0.3 - 0.01 * n) * std::cos(2.0 * (phi - 0.4 * row));
    }
  }
  return set;
}

/// Four seconds of the synthetic walker at 50 Hz, as a recording with CMU's names: what `mimesis
/// demix` reads from a BVH file.
mocap::Clip recorded_walker() {
  const auto model =
      synthesizer::testing::walking_model({.speed_m_s = 0.9, .duration_s = 1.1, .harmonics = 12});
  const mocap::Body& body = model.body;
  const mocap::BodyMap& map = mocap::known_body_maps()[0];
  mocap::Clip clip;
  clip.name = "walker";
  clip.rate_hz = 50.0;
  for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) {
    clip.skeleton.joints.push_back({map.joints[j], mocap::kBodyParents[j], body.offset_m[j]});
  }
  for (const std::size_t side : {0U, 1U}) {
    const int ankle = side == 0 ? mocap::kLeftAnkle : mocap::kRightAnkle;
    const Eigen::Vector3d ball = body.toe_m[side] + Eigen::Vector3d(0.0, 0.0, 0.04);
    clip.skeleton.joints.push_back({map.toes[side], ankle, ball});
  }
  constexpr Eigen::Index kFrames = 200;
  const auto joints = static_cast<Eigen::Index>(clip.skeleton.joints.size());
  clip.rotation_rad = Eigen::MatrixXd::Zero(3 * joints, kFrames);
  clip.root_position_W_m.resize(3, kFrames);
  synthesizer::CharacterBatch batch(model, 1, {.dt_s = 1.0 / clip.rate_hz});
  for (Eigen::Index t = 0; t < kFrames; ++t) {
    batch.step();
    const synthesizer::RootPose root = batch.root(0);
    clip.root_position_W_m.col(t) << root.position_W_m, root.height_m;
    for (int r = 0; r < mocap::kBodyRows; ++r) {
      clip.rotation_rad(r, t) = static_cast<double>(batch.angles(0)[static_cast<std::size_t>(r)]);
    }
  }
  return clip;
}

/// The clip as a BVH file in cm, y up.
std::string bvh_text(const mocap::Clip& clip) {
  const auto in_file = [](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v.y(), v.z(), v.x());
  };
  const auto line = [](const Eigen::Vector3d& v) {
    return fmt::format("{} {} {} ", v.x(), v.y(), v.z());
  };
  const double unit_m = 0.01;
  const std::vector<mocap::Joint>& joints = clip.skeleton.joints;
  std::string text = "HIERARCHY\n";
  std::vector<int> order;
  const std::function<void(int)> write = [&](int j) {
    const mocap::Joint& joint = joints[static_cast<std::size_t>(j)];
    text +=
        fmt::format("{} {}\n{{\nOFFSET {}\nCHANNELS {}Zrotation Yrotation Xrotation\n",
                    j == 0 ? "ROOT" : "JOINT", joint.name, line(in_file(joint.offset_m) / unit_m),
                    j == 0 ? "6 Xposition Yposition Zposition " : "3 ");
    order.push_back(j);
    const std::size_t before = order.size();
    for (int k = j + 1; k < static_cast<int>(joints.size()); ++k) {
      if (joints[static_cast<std::size_t>(k)].parent == j) write(k);
    }
    if (order.size() == before) text += "End Site\n{\nOFFSET 0 0 0\n}\n";
    text += "}\n";
  };
  write(0);
  text += fmt::format("MOTION\nFrames: {}\nFrame Time: {}\n", clip.frames(), 1.0 / clip.rate_hz);
  for (Eigen::Index t = 0; t < clip.frames(); ++t) {
    text += line(in_file(clip.root_position_W_m.col(t)) / unit_m);
    for (const int j : order) {
      const Eigen::Vector3d turn = in_file(clip.rotation_rad.block<3, 1>(3 * j, t));
      text += line(math::exp_so3(turn).eulerAngles(2, 1, 0) * 180.0 / M_PI);
    }
    text += '\n';
  }
  return text;
}

const std::string kBiped = std::string(MIMESIS_SOURCE_DIR) + "/models/biped.yaml";

class Demix : public testing::VerbTest {
 protected:
  Demix() { mocap::write_trials(waves(), path("waves.csv")); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  int run(std::vector<std::string> words) {
    words.insert(words.begin(), "demix");
    return call(words);
  }
  /// Exit code 2 and one line that contains `text`.
  void refuses(const std::vector<std::string>& words, const std::string& text) {
    EXPECT_EQ(run(words), 2) << output_;
    EXPECT_NE(errors_.find(text), std::string::npos) << errors_;
    EXPECT_EQ(std::ranges::count(errors_, '\n'), 1) << errors_;
    EXPECT_FALSE(fs::exists(path("m.motion.json")));
  }

  testing::TemporaryFolder folder_;
};

TEST_F(Demix, LearnsAModelWithItsProvenance) {
  ASSERT_EQ(run({path("waves.csv"), "-k", "2", "--tied", "--licence", "own", "--json", "-o",
                 path("m.motion.json")}),
            0)
      << errors_;
  const json report = json::parse(output_);
  EXPECT_EQ(report["trials"], 6);
  EXPECT_GT(report["Q"], 0.999);
  EXPECT_GT(report["Q2"], report["Q"]);
  EXPECT_EQ(report["others"].size(), 1U);
  EXPECT_LT(report["others"][0]["Q"], report["Q"]);
  EXPECT_LT(report["joints"][0]["rms_rad"], 1e-3);
  EXPECT_NE(errors_.find("a standard one of 1.70 m"), std::string::npos) << errors_;
  const auto model = motion::load_motion_model(path("m.motion.json"));
  EXPECT_EQ(model.name, "m");
  EXPECT_TRUE(model.tied);
  EXPECT_EQ(model.patterns.size(), 6U);
  EXPECT_DOUBLE_EQ(model.patterns[5].trial.duration_s, 1.5);
  ASSERT_EQ(model.learned_from.size(), 1U);
  EXPECT_EQ(model.learned_from[0].file, "waves.csv");
  EXPECT_EQ(model.learned_from[0].licence, "own");
  EXPECT_EQ(model.learned_from[0].sha256, sha256_of(path("waves.csv")));
}

TEST_F(Demix, SaysHowWellLeftOutTrialsAreDescribed) {
  mocap::Trials set = waves();
  for (int i = 4; i < 6; ++i) set.trials[static_cast<std::size_t>(i)].clip = "other";
  for (int t = 0; t < 50; ++t) {  // the other clip moves otherwise
    set.samples.bottomRows(6).col(t).array() += 0.5 * std::cos(6.0 * M_PI * t / 50.0);
  }
  mocap::write_trials(set, path("clips.csv"));
  const auto report_of = [this](const std::string& file, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {path(file),           "-k", "3", "--tied", "--json", "-o",
                                      path("m.motion.json")};
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(run(words), 0) << errors_;
    return json::parse(output_);
  };
  const json clips = report_of("clips.csv");
  EXPECT_GT(clips["Q"], 0.99);
  EXPECT_LT(clips["Q_held_out"], 0.9);
  EXPECT_GT(clips["Q2_held_out"], clips["Q_held_out"]);
  EXPECT_EQ(clips["held_out"]["by"], "clip");
  EXPECT_EQ(clips["held_out"]["groups"], 2);
  for (const json& other : clips["others"]) {
    EXPECT_LE(other["Q_held_out"].get<double>(), other["Q"].get<double>() + 1e-3) << other["name"];
  }
  const json none = report_of("clips.csv", {"--no-held-out"});
  EXPECT_FALSE(none.contains("held_out"));
  EXPECT_FALSE(none.contains("Q_held_out"));
  EXPECT_EQ(none["Q"], clips["Q"]);
  const std::string out = path("m.motion.json");
  ASSERT_EQ(run({path("waves.csv"), "-k", "2", "--tied", "-o", out}), 0) << errors_;
  EXPECT_NE(output_.find("held out: each of 6 trials once"), std::string::npos) << output_;
}

TEST_F(Demix, TheTableSaysTheSame) {
  ASSERT_EQ(run({path("waves.csv"), "-k", "3", "--fixed", "1", "-o", path("m.motion.json")}), 0)
      << errors_;
  EXPECT_NE(output_.find("anechoic (SISA)"), std::string::npos) << output_;
  EXPECT_NE(output_.find("principal components (PCA)"), std::string::npos);
  EXPECT_NE(output_.find("lknee"), std::string::npos);
  EXPECT_EQ(motion::load_motion_model(path("m.motion.json")).fixed, 1);
}

TEST_F(Demix, SmoothsSources) {
  ASSERT_EQ(run({path("waves.csv"), "-k", "2", "--tied", "--smooth", "4", "--json", "-o",
                 path("m.motion.json")}),
            0)
      << errors_;
  EXPECT_GT(json::parse(output_)["Q"], 0.99);
  EXPECT_NE(motion::load_motion_model(path("m.motion.json")).created_by.find("--smooth 4"),
            std::string::npos);
  fs::remove(path("m.motion.json"));
  const std::string out = path("m.motion.json");
  refuses({path("waves.csv"), "-k", "2", "--smooth", "1", "-o", out}, "order 3");
  refuses({path("waves.csv"), "-k", "2", "--smooth", "25", "-o", out}, "50 samples");
}

TEST_F(Demix, StylesAreNamedAndAveraged) {
  ASSERT_EQ(run({path("waves.csv"), "-k", "2", "--tied", "--average", "--style", "waves.csv=calm",
                 "-o", path("m.motion.json")}),
            0)
      << errors_;
  const auto model = motion::load_motion_model(path("m.motion.json"));
  ASSERT_EQ(model.patterns.size(), 1U);
  EXPECT_EQ(model.patterns[0].trial.style, "calm");
  EXPECT_NEAR(model.patterns[0].trial.duration_s, 1.25, 1e-12);
}

TEST_F(Demix, TheMapThatIsPrintedCanBeEditedAndGiven) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(path(name)) << text;
  };
  const std::string walker = bvh_text(recorded_walker()), out = path("m.motion.json");
  write("walker.bvh", walker);
  ASSERT_EQ(call({"motion", "map", path("walker.bvh")}), 0) << errors_;
  std::string map = output_;
  EXPECT_NE(map.find("lknee: \"LeftLeg\""), std::string::npos) << map;
  write("map.yaml", map);
  ASSERT_EQ(run({path("walker.bvh"), "--map", path("map.yaml"), "-k", "2", "-o", out}), 0)
      << errors_;
  std::filesystem::remove(out);
  const auto at = map.find("LeftLeg");
  write("map.yaml", map.replace(at, 7, "Shin"));
  refuses({path("walker.bvh"), "--map", path("map.yaml"), "-o", out},
          "joint 'Shin' of the map (lknee), expected one that the file has");
  refuses({path("walker.bvh"), "--unit-m", "1", "-o", out}, "--unit-m 1 the figure is 1");
}

/// Checks a report on clips retargeted to the biped, and the model.
void check_robot(const json& report, const std::string& file, std::size_t clips) {
  ASSERT_EQ(report["retargeting"].size(), clips);
  for (const json& clip : report["retargeting"]) {
    EXPECT_LT(clip["foot_m"]["max"], 1e-3) << clip;
    EXPECT_LT(clip["foot_rad"]["max"], 1e-2) << clip;
    EXPECT_LT(clip["figure_ankle_m"]["max"], 1e-6) << clip;
    EXPECT_GT(clip["speed_share"], 0.05);
    EXPECT_NEAR(clip["scale"].get<double>(), 0.75, 0.1);
    EXPECT_GE(clip["frames_at_limits"], 0);
  }
  const robot::RobotTree tree = model::load_biped(kBiped).tree;
  const auto model = motion::load_motion_model(file);
  ASSERT_EQ(model.rows.size(), mocap::kBodyRows + static_cast<std::size_t>(tree.dof()));
  EXPECT_EQ(model.rows[3], "lhip.x");
  EXPECT_EQ(model.rows[mocap::kBodyRows], tree.moved(0).joint);
  EXPECT_NEAR(model.body.offset_m[mocap::kLeftKnee].norm(), 0.302, 1e-3);
  ASSERT_EQ(model.limits_rad.size(), model.rows.size());
  EXPECT_FALSE(model.limits_rad[3]);
  EXPECT_EQ(report["limits"].size(), static_cast<std::size_t>(tree.dof()));
  EXPECT_EQ(report["joints"].back()["joint"], tree.moved(tree.dof() - 1).joint);
  const auto row = static_cast<std::size_t>(mocap::kBodyRows + tree.require_joint("left_knee"));
  ASSERT_TRUE(model.limits_rad[row]);
  EXPECT_EQ(model.limits_rad[row]->upper, tree.upper()[tree.require_joint("left_knee")]);
  const auto at = static_cast<Eigen::Index>(row);  // it bends and stretches, in the same rhythm
  EXPECT_GT(model.patterns[0].weight_rad.row(at).norm(), 0.1);
  EXPECT_NE(model.created_by.find("--robot biped.yaml"), std::string::npos);
}

TEST_F(Demix, RetargetsClipsToARobot) {
  std::ofstream(path("walker.bvh")) << bvh_text(recorded_walker());
  const std::string out = path("m.motion.json");
  ASSERT_EQ(run({path("walker.bvh"), "--robot", kBiped, "-k", "3", "--json", "-o", out}), 0)
      << errors_;
  const json report = json::parse(output_);
  check_robot(report, out, 1);
  EXPECT_EQ(report["trials"], 2);
  EXPECT_EQ(report["retargeting"][0]["frames"], 200);
  // the travel of the robot's figure per cycle is the walker's, scaled by the length of the legs
  const auto model = motion::load_motion_model(out);
  EXPECT_NEAR(model.patterns[0].trial.step_length_m,
              0.9 * 1.1 * report["retargeting"][0]["scale"].get<double>(), 0.05);
  fs::remove(out);
  refuses({path("walker.bvh"), "--robot", path("none.yaml"), "-o", out}, "none.yaml");
  refuses({path("waves.csv"), "--robot", kBiped, "-o", out}, "--robot needs clips");
}

TEST_F(Demix, RetargetsARecordedWalk) {
  using mocap::shared_mocap;
  SKIP_WITHOUT_SHARED();
  const std::string out = path("m.motion.json");
  ASSERT_EQ(run({mocap::shared_mocap() + "cmu_bvh/07_12.bvh", "--robot", kBiped, "-k", "4",
                 "--tied", "-o", out}),
            0)
      << errors_;
  EXPECT_NE(output_.find("0 of 30 rows with limits pass them"), std::string::npos) << output_;
  EXPECT_NE(output_.find("at their limits in 0 of 262 frames: none"), std::string::npos);
}

TEST_F(Demix, ReadsMarkers) {
  using mocap::shared_mocap;
  SKIP_WITHOUT_SHARED();
  const std::string c3d = mocap::shared_mocap() + "c3d/", out = path("m.motion.json");
  ASSERT_EQ(run({c3d + "FunctionalWalk.c3d", c3d + "pc_real.c3d", "--markers-legs-only", "-k", "2",
                 "--json", "-o", out}),
            0)
      << errors_;
  const json report = json::parse(output_);
  EXPECT_EQ(report["trials"], 2);
  ASSERT_EQ(report["left_out"].size(), 1U);  // a ball with a few markers
  EXPECT_NE(report["left_out"][0]["reason"].get<std::string>().find("LASI"), std::string::npos);
  fs::remove(out);
  refuses({c3d + "FunctionalWalk.c3d", "-o", out}, "no trial is left: FunctionalWalk.c3d: markers");
  refuses({c3d + "Empty.c3d", "-o", out}, "Empty.c3d");
}

TEST_F(Demix, RefusesWhatCannotBe) {
  const std::string out = path("m.motion.json");
  refuses({path("none.bvh"), "-o", out}, "none.bvh");
  std::ofstream(path("empty.csv")).close();
  refuses({path("empty.csv"), "-o", out}, "empty.csv");
  refuses({path("waves.csv"), "-k", "40", "-o", out}, "40");
  refuses({path("waves.csv"), "--average", "-o", out}, "--average: needs --tied");
  refuses({path("waves.csv"), "--style", "calm", "-o", out}, "is not FILE=NAME");
  refuses({path("waves.csv"), "--style", "x.bvh=calm", "-o", out}, "x.bvh is none of the files");
  mocap::Trials bad = waves();
  bad.samples(7, 3) = std::nan("");
  mocap::write_trials(bad, path("nan.csv"));
  refuses({path("nan.csv"), "-o", out}, "nan.csv:");
  mocap::Trials other = waves();
  other.rows[2] = "neck.z";
  mocap::write_trials(other, path("other.csv"));
  refuses({path("waves.csv"), path("other.csv"), "-o", out}, "neck.z");
  EXPECT_EQ(run({path("waves.csv")}), 2);
}

TEST(Sha256, IsTheStandardOne) {  // FIPS 180-2, "abc"
  const std::string file = fs::temp_directory_path() / ("abc-" + std::to_string(getpid()));
  std::ofstream(file) << "abc";
  EXPECT_EQ(sha256_of(file), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  fs::remove(file);
}

}  // namespace
}  // namespace mimesis::tool
