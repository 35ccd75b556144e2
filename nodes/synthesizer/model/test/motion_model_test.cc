#include "nodes/synthesizer/model/motion_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

MotionModel small_model() {
  MotionModel model;
  model.name = "walk";
  model.created_by = "test";
  model.learned_from = {{"a.bvh", std::string(64, 'a'), "CMU"}};
  model.body = mocap::standard_body();
  model.rows = {"lhip.x", "lhip.y"};
  model.task_names = {"distance_m"};
  model.sources = Eigen::MatrixXd::Random(3, 8);
  model.fixed = 1;
  model.tied = true;
  Pattern pattern;
  pattern.trial = {.clip = "a.bvh",
                   .style = "slow",
                   .cycle = 2,
                   .first_frame = 10,
                   .last_frame = 150,
                   .duration_s = 1.1,
                   .step_length_m = 0.7,
                   .turn_rad = 1.0 / 3.0,
                   .task = {0.6}};
  pattern.mean_rad = Eigen::VectorXd::Random(2);
  pattern.weight_rad = Eigen::MatrixXd::Random(2, 3);
  pattern.delay_rad = Eigen::MatrixXd::Random(2, 3);
  model.patterns = {pattern, pattern};
  model.quality = 0.9;
  model.quality_squared = 0.99;
  return model;
}

class MotionModelFile : public ::testing::Test {
 protected:
  std::filesystem::path dir_ = std::filesystem::path(::testing::TempDir()) /
                               ::testing::UnitTest::GetInstance()->current_test_info()->name();
  std::string file_ = (dir_ / "walk.motion.json").string();
  void SetUp() override { std::filesystem::create_directories(dir_); }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  std::string text() const {
    std::ostringstream out;
    out << std::ifstream(file_).rdbuf();
    return out.str();
  }
  /// The message that loading the file gives after `from` in it is replaced.
  std::string message(const std::string& from, const std::string& to) {
    save_motion_model(small_model(), file_);
    std::string changed = text();
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    changed.replace(at, from.size(), to);
    std::ofstream(file_) << changed;
    try {
      load_motion_model(file_);
    } catch (const ConfigError& e) {
      return std::string(e.what()).substr(dir_.string().size() + 1);
    }
    return "loaded";
  }
};

TEST_F(MotionModelFile, ComesBackBitByBit) {
  const MotionModel model = small_model();
  save_motion_model(model, file_);
  const MotionModel back = load_motion_model(file_);
  EXPECT_EQ(back.name, model.name);
  EXPECT_EQ(back.learned_from[0].sha256, model.learned_from[0].sha256);
  EXPECT_EQ(back.rows, model.rows);
  EXPECT_EQ(back.task_names, model.task_names);
  EXPECT_EQ(back.sources, model.sources);
  EXPECT_EQ(back.fixed, 1);
  EXPECT_TRUE(back.tied);
  ASSERT_EQ(back.patterns.size(), 2u);
  EXPECT_EQ(back.patterns[1].weight_rad, model.patterns[1].weight_rad);
  EXPECT_EQ(back.patterns[1].delay_rad, model.patterns[1].delay_rad);
  EXPECT_EQ(back.patterns[1].mean_rad, model.patterns[1].mean_rad);
  EXPECT_EQ(back.patterns[1].trial.turn_rad, 1.0 / 3.0);
  EXPECT_EQ(back.patterns[1].trial.task, model.patterns[1].trial.task);
  EXPECT_EQ(back.patterns[1].trial.last_frame, 150);
  for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) {
    EXPECT_EQ(back.body.offset_m[j], model.body.offset_m[j]);
  }
  EXPECT_EQ(back.body.toe_m[1], model.body.toe_m[1]);
  const std::string first = text();
  save_motion_model(back, file_);
  EXPECT_EQ(text(), first);
}

TEST_F(MotionModelFile, SaysWhereItIsDamaged) {
  EXPECT_EQ(message("mimesis.motion", "something"),
            "walk.motion.json: format: 'something', expected 'mimesis.motion'");
  EXPECT_EQ(message("\"version\":1", "\"version\":2"), "walk.motion.json: version: 2, expected 1");
  EXPECT_EQ(message("\"rows\":[\"lhip.x\",", "\"rows\":["),
            "walk.motion.json: patterns[0].mean_rad: 2 numbers, expected 1");
  EXPECT_EQ(message("\"tied\":true", "\"tied\":1"),
            "walk.motion.json: tied: expected true or false");
  EXPECT_EQ(message("\"duration_s\":1.1", "\"duration_s\":null"),
            "walk.motion.json: patterns[0].duration_s: expected a finite number");
  EXPECT_EQ(message("\"duration_s\":1.1", "\"duration_s\":-1"),
            "walk.motion.json: patterns[0].duration_s: expected more than 0");
  EXPECT_EQ(message("\"fixed\":1", "\"fixed\":4"), "walk.motion.json: fixed: 4 of 3 sources");
  EXPECT_EQ(message("\"task_names\"", "\"tasks\""), "walk.motion.json: task_names: is missing");
  EXPECT_EQ(message("{", "").substr(0, 27), "walk.motion.json: not JSON ");
  EXPECT_THROW(load_motion_model(file_ + ".none"), ConfigError);
}

TEST_F(MotionModelFile, IsWrittenWholeOrNotAtAll) {
  save_motion_model(small_model(), file_);
  const std::string before = text();
  MotionModel broken = small_model();
  broken.patterns[0].weight_rad(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(save_motion_model(broken, file_), ConfigError);
  broken = small_model();
  broken.patterns[1].delay_rad.resize(1, 3);
  broken.patterns[1].delay_rad.setZero();
  EXPECT_THROW(save_motion_model(broken, file_), ConfigError);
  EXPECT_EQ(text(), before);
  EXPECT_THROW(save_motion_model(small_model(), (dir_ / "no" / "folder").string()), ConfigError);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir_), {}), 1);
}

}  // namespace
}  // namespace mimesis::synthesizer
