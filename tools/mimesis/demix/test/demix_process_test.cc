// `mimesis demix`: the real program on files of trials and clips made here.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/testing/process.h"
#include "nodes/synthesizer/mocap/trials_file.h"
#include "nodes/synthesizer/model/motion_model.h"
#include "tools/mimesis/demix/trial_files.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::Process;
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

class Demix : public ::testing::Test {
 protected:
  Demix() : folder_(fs::temp_directory_path() / ("mimesis-demix-" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
    mocap::write_trials(waves(), path("waves.csv"));
  }
  ~Demix() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }

  int run(std::vector<std::string> words) {
    words.insert(words.begin(), "demix");
    Process p("mimesis", words);
    const int code = p.wait(60s).value_or(-1);
    output_ = p.output();
    errors_ = p.errors();
    return code;
  }
  /// Exit code 2 and one line that contains `text`.
  void refuses(const std::vector<std::string>& words, const std::string& text) {
    EXPECT_EQ(run(words), 2) << output_;
    EXPECT_NE(errors_.find(text), std::string::npos) << errors_;
    EXPECT_EQ(std::ranges::count(errors_, '\n'), 1) << errors_;
    EXPECT_FALSE(fs::exists(path("m.motion.json")));
  }

  fs::path folder_;
  std::string output_, errors_;
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
  EXPECT_EQ(report["others"].size(), 4U);
  EXPECT_LT(report["others"][0]["Q"], report["Q"]);
  EXPECT_LT(report["joints"][0]["rms_rad"], 1e-3);
  EXPECT_NE(errors_.find("a standard one of 1.70 m"), std::string::npos) << errors_;
  const auto model = synthesizer::load_motion_model(path("m.motion.json"));
  EXPECT_EQ(model.name, "m");
  EXPECT_TRUE(model.tied);
  EXPECT_EQ(model.patterns.size(), 6U);
  EXPECT_DOUBLE_EQ(model.patterns[5].trial.duration_s, 1.5);
  ASSERT_EQ(model.learned_from.size(), 1U);
  EXPECT_EQ(model.learned_from[0].file, "waves.csv");
  EXPECT_EQ(model.learned_from[0].licence, "own");
  EXPECT_EQ(model.learned_from[0].sha256, sha256_of(path("waves.csv")));
}

TEST_F(Demix, TheTableSaysTheSame) {
  ASSERT_EQ(run({path("waves.csv"), "-k", "3", "--fixed", "1", "-o", path("m.motion.json")}), 0)
      << errors_;
  EXPECT_NE(output_.find("anechoic (SISA)"), std::string::npos) << output_;
  EXPECT_NE(output_.find("PCA of about as many parameters"), std::string::npos);
  EXPECT_NE(output_.find("lknee"), std::string::npos);
  EXPECT_EQ(synthesizer::load_motion_model(path("m.motion.json")).fixed, 1);
}

TEST_F(Demix, SmoothsSources) {
  ASSERT_EQ(run({path("waves.csv"), "-k", "2", "--tied", "--smooth", "4", "--json", "-o",
                 path("m.motion.json")}),
            0)
      << errors_;
  EXPECT_GT(json::parse(output_)["Q"], 0.99);
  EXPECT_NE(synthesizer::load_motion_model(path("m.motion.json")).created_by.find("--smooth 4"),
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
  const auto model = synthesizer::load_motion_model(path("m.motion.json"));
  ASSERT_EQ(model.patterns.size(), 1U);
  EXPECT_EQ(model.patterns[0].trial.style, "calm");
  EXPECT_NEAR(model.patterns[0].trial.duration_s, 1.25, 1e-12);
}

TEST_F(Demix, RefusesWhatCannotBe) {
  const std::string out = path("m.motion.json");
  refuses({path("none.bvh"), "-o", out}, "none.bvh");
  std::ofstream(path("empty.csv"));
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
