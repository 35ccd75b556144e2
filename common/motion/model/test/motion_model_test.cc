#include "common/motion/model/motion_model.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/motion/demix/test/known_mixture.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::motion {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

MotionModel small_model(bool tied) {
  MotionModel m;
  m.name = "small";
  m.created_by = "mimesis demix 0.1.0 --sources 2";
  m.learned_from = {{"07_01.bvh", std::string(64, 'a'), "CMU"}};
  m.body = mocap::standard_body();
  m.rows = {"lhip.x", "lhip.y", "lknee.y"};
  m.task_names = {"object_depth_m"};
  m.sources = Eigen::MatrixXd::Random(2, 8);
  m.fixed = 1;
  m.tied = tied;
  for (int i = 0; i < 3; ++i) {
    Pattern p;
    p.trial = {.clip = "07_01.bvh",
               .style = "slow",
               .cycle = i,
               .first_frame = 3,
               .last_frame = 99,
               .duration_s = 1.1 + 0.1 * i,
               .step_length_m = 0.7,
               .turn_rad = -0.1,
               .task = {0.14}};
    p.mean_rad = Eigen::VectorXd::Random(3);
    p.weight_rad = Eigen::MatrixXd::Random(3, 2);
    p.delay_rad = tied && i > 0 ? m.patterns[0].delay_rad : Eigen::MatrixXd::Random(3, 2);
    m.patterns.push_back(p);
  }
  m.quality = 0.93;
  m.quality_squared = 0.995;
  return m;
}

class MotionModelFile : public ::testing::Test {
 protected:
  /// Error of loading the file after `change`; empty if it is accepted.
  std::string complaint(const std::function<void(Json&)>& change, bool tied = true) {
    save_motion_model(small_model(tied), file_);
    Json json;
    std::ifstream(file_) >> json;
    change(json);
    std::ofstream(file_) << json.dump();
    return complaint();
  }
  std::string complaint() const {
    try {
      load_motion_model(file_);
    } catch (const ConfigError& e) {
      const std::string text = e.what();
      EXPECT_TRUE(text.starts_with(file_ + ": ")) << text;
      EXPECT_EQ(text.find('\n'), std::string::npos);
      return text.substr(file_.size() + 2);
    }
    return {};
  }

  testing::TemporaryFolder folder_;
  std::string file_ = (folder_ / "m.motion.json").string();
};

TEST_F(MotionModelFile, ComesBackBitForBit) {
  for (const bool tied : {false, true}) {
    const MotionModel m = small_model(tied);
    save_motion_model(m, file_);
    const MotionModel r = load_motion_model(file_);
    EXPECT_EQ(r.name, m.name);
    EXPECT_EQ(r.created_by, m.created_by);
    ASSERT_EQ(r.learned_from.size(), 1U);
    EXPECT_EQ(r.learned_from[0].sha256, m.learned_from[0].sha256);
    EXPECT_EQ(r.body.offset_m, m.body.offset_m);
    EXPECT_EQ(r.body.toe_m, m.body.toe_m);
    EXPECT_EQ(r.body.head_top_m, m.body.head_top_m);
    EXPECT_EQ(r.rows, m.rows);
    EXPECT_EQ(r.sources, m.sources);
    EXPECT_EQ(r.fixed, 1);
    EXPECT_EQ(r.tied, tied);
    EXPECT_EQ(r.quality_squared, m.quality_squared);
    ASSERT_EQ(r.patterns.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(r.patterns[i].trial.cycle, static_cast<int>(i));
      EXPECT_EQ(r.patterns[i].trial.duration_s, m.patterns[i].trial.duration_s);
      EXPECT_EQ(r.patterns[i].trial.task, m.patterns[i].trial.task);
      EXPECT_EQ(r.patterns[i].mean_rad, m.patterns[i].mean_rad);
      EXPECT_EQ(r.patterns[i].weight_rad, m.patterns[i].weight_rad);
      EXPECT_EQ(r.patterns[i].delay_rad, m.patterns[i].delay_rad);
    }
  }
}

TEST_F(MotionModelFile, TellsWhatDoesNotFit) {
  EXPECT_EQ(complaint([](Json&) {}), "");
  EXPECT_EQ(complaint([](Json& j) { j["format"] = "x"; }),
            "format is 'x', expected 'mimesis.motion'");
  EXPECT_EQ(complaint([](Json& j) { j["version"] = 2; }), "version is 2, expected 1");
  EXPECT_EQ(complaint([](Json& j) { j.erase("rows"); }), "rows is missing");
  EXPECT_EQ(complaint([](Json& j) { j["patterns"] = Json::array(); }),
            "patterns is empty, expected one pattern at least");
  EXPECT_EQ(complaint([](Json& j) { j["patterns"][1]["mean_rad"].erase(0); }),
            "patterns[1].mean_rad is an array of 2, expected 3 elements");
  EXPECT_EQ(complaint([](Json& j) { j["patterns"][2]["weight_rad"][1][0] = "a"; }),
            "patterns[2].weight_rad[1][0] is string, expected a number");
  EXPECT_EQ(complaint([](Json& j) { j["sources"][1].erase(0); }),
            "sources[1] is an array of 7, expected 8 elements");
  EXPECT_EQ(complaint([](Json& j) { j["patterns"][0]["duration_s"] = 0; }),
            "patterns[0].duration_s is not positive, expected a time in s");
  EXPECT_EQ(complaint([](Json& j) { j["fixed"] = 3; }), "fixed is 3, expected 0 to 2");
  EXPECT_EQ(complaint([](Json& j) { j["delay_rad"].erase(0); }),
            "delay_rad is an array of 2, expected 3 elements");
  EXPECT_EQ(complaint([](Json& j) { j["patterns"][0].erase("delay_rad"); }, false),
            "patterns[0].delay_rad is missing");
  EXPECT_EQ(complaint([](Json& j) { j["body"]["offset_m"].erase("lknee"); }),
            "body.offset_m.lknee is missing");
  EXPECT_EQ(complaint([](Json& j) { j["patterns"][0]["task"] = Json::array(); }),
            "patterns[0].task is an array of 0, expected 1 elements");
}

TEST(MotionModelText, MayHoldAnyBytes) {
  const auto says = [](const std::string& text) -> std::string {
    return testing::refusal([&] { parse_motion_model(text, "m"); }, "taken");
  };
  EXPECT_EQ(says("{\"format\": 1e999}"),
            "m: a number is too large, expected a motion model (*.motion.json)");
  EXPECT_EQ(says("{\"format\": \"a\\nb\"}"), "m: format is 'a?b', expected 'mimesis.motion'");
  EXPECT_EQ(says("[1]"), "m: the file is array, expected an object");
}

TEST_F(MotionModelFile, ReplacesNothingButFiles) {
  save_motion_model(small_model(true), file_);
  save_motion_model(small_model(false), file_);  // a file, once more
  EXPECT_FALSE(load_motion_model(file_).tied);
  const std::string folder = file_ + ".folder";
  fs::create_directory(folder);
  EXPECT_THROW(save_motion_model(small_model(true), folder), ConfigError);
  EXPECT_TRUE(fs::is_directory(folder));
  fs::remove(folder);
  const std::string pipe = file_ + ".pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(save_motion_model(small_model(true), pipe), ConfigError);
  EXPECT_TRUE(fs::is_fifo(pipe));
  fs::remove(pipe);
}

TEST_F(MotionModelFile, IsCutAnywhereWithoutHarm) {
  save_motion_model(small_model(true), file_);
  const auto size = fs::file_size(file_);
  for (std::uintmax_t cut = 0; cut + 2 < size; cut += 37) {
    save_motion_model(small_model(true), file_);
    fs::resize_file(file_, cut);
    EXPECT_NE(complaint().find("no JSON there"), std::string::npos) << cut;
  }
}

TEST_F(MotionModelFile, LimitsAreOptional) {
  MotionModel m = small_model(true);
  save_motion_model(m, file_);
  Json json;
  std::ifstream(file_) >> json;
  EXPECT_FALSE(json.contains("limits_rad"));  // older files have no limits
  EXPECT_EQ(json["version"], 1);
  EXPECT_TRUE(load_motion_model(file_).limits_rad.empty());
  m.limits_rad = {std::nullopt, RowLimits{-0.5, 1.0 / 3.0}, std::nullopt};
  save_motion_model(m, file_);
  const MotionModel r = load_motion_model(file_);
  ASSERT_EQ(r.limits_rad.size(), 3U);
  EXPECT_FALSE(r.limits_rad[0] || r.limits_rad[2]);
  ASSERT_TRUE(r.limits_rad[1]);
  EXPECT_EQ(r.limits_rad[1]->lower, -0.5);
  EXPECT_EQ(r.limits_rad[1]->upper, 1.0 / 3.0);
  const auto with = [this](const Json& limits) {
    return complaint([&](Json& j) { j["limits_rad"] = limits; });
  };
  EXPECT_EQ(with({{-1, 1}}), "limits_rad is an array of 1, expected 3 elements");
  EXPECT_EQ(with({nullptr, nullptr, {1}}), "limits_rad[2] is an array of 1, expected 2 elements");
  EXPECT_EQ(with({nullptr, {1.0, 1.0}, nullptr}), "limits_rad[1] is empty, expected lower < upper");
  EXPECT_EQ(with("none"), "limits_rad is string, expected an array");
}

TEST_F(MotionModelFile, IsWrittenWholeOrNotAtAll) {
  EXPECT_THROW(load_motion_model(file_), ConfigError);
  EXPECT_THROW(save_motion_model(small_model(true), (folder_ / "no/where").string()), ConfigError);
  MotionModel m = small_model(true);
  save_motion_model(m, file_);
  EXPECT_FALSE(fs::exists(file_ + ".part"));
  const std::string folder = (folder_ / "folder").string();
  fs::create_directories(folder + "/x");
  EXPECT_THROW(save_motion_model(m, folder), ConfigError);  // cannot replace a folder
  EXPECT_FALSE(fs::exists(folder + ".part"));
}

TEST(MakeModel, HasAPatternForEveryTrial) {
  const demix::Known known = demix::known_mixture({.trials = 3, .rows = 4, .tied = true});
  const MotionModel m = make_model(known.set, known.mixture, true, mocap::standard_body());
  ASSERT_EQ(m.patterns.size(), 3U);
  EXPECT_NEAR(m.quality, 1.0, 1e-9);
  EXPECT_EQ(m.patterns[2].weight_rad, known.mixture.weights.bottomRows(4));
  EXPECT_EQ(m.patterns[1].delay_rad, m.patterns[0].delay_rad);
  EXPECT_EQ(m.patterns[1].mean_rad, known.mixture.means.segment(4, 4));
  demix::Mixture other = known.mixture;
  other.weights = other.weights.topRows(8).eval();
  EXPECT_THROW(make_model(known.set, other, true, mocap::standard_body()), ConfigError);
}

TEST(MakeModel, StylesAreAveraged) {
  demix::Known known = demix::known_mixture({.trials = 3, .rows = 4, .tied = true});
  const char* styles[] = {"slow", "fast", "slow"};
  for (std::size_t i = 0; i < 3; ++i) {
    known.set.trials[i].style = styles[i];
    known.set.trials[i].duration_s = 1.0 + double(i);
  }
  const MotionModel all = make_model(known.set, known.mixture, true, mocap::standard_body());
  const MotionModel mean = average_styles(all);
  ASSERT_EQ(mean.patterns.size(), 2U);
  EXPECT_EQ(mean.patterns[0].trial.style, "slow");
  EXPECT_DOUBLE_EQ(mean.patterns[0].trial.duration_s, 2.0);
  EXPECT_LT((mean.patterns[0].weight_rad -
             0.5 * (all.patterns[0].weight_rad + all.patterns[2].weight_rad))
                .norm(),
            1e-14);
  EXPECT_EQ(mean.patterns[1].mean_rad, all.patterns[1].mean_rad);
  MotionModel free = all;
  free.tied = false;
  EXPECT_THROW(average_styles(free), ConfigError);
}

}  // namespace
}  // namespace mimesis::motion
