// models/biped_walk.motion.json on models/biped.urdf.
#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>
#include <set>

#include "common/motion/model/motion_model.h"
#include "common/robot/robot_tree.h"
#include "nodes/synthesizer/dynamics/character_batch.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kRate = 200.0;  // Hz

const std::string kModels = std::string(MIMESIS_SOURCE_DIR) + "/models/";

class BipedWalk : public ::testing::Test {
 protected:
  const motion::MotionModel model_ = motion::load_motion_model(kModels + "biped_walk.motion.json");
  const robot::RobotTree tree_ = robot::read_urdf(kModels + "biped.urdf");

  CharacterBatch walker(int pattern) const {
    CharacterBatch batch(model_, 1, {.dt_s = 1.0 / kRate, .harmonics = 12, .foot_lock = true});
    const double duration_s = model_.patterns[static_cast<std::size_t>(pattern)].trial.duration_s;
    batch.set_pattern(0, pattern);
    batch.set_frequency(0, 2.0 * std::numbers::pi / duration_s);
    return batch;
  }
};

TEST_F(BipedWalk, IsAModelOfTheRobotsJoints) {
  EXPECT_LT(std::filesystem::file_size(kModels + "biped_walk.motion.json"), 400'000U);
  EXPECT_TRUE(model_.tied);
  ASSERT_EQ(model_.rows.size(), mocap::kBodyRows + std::size_t(tree_.dof()));
  ASSERT_EQ(model_.limits_rad.size(), model_.rows.size());
  for (int i = 0; i < tree_.dof(); ++i) {
    const auto row = static_cast<std::size_t>(mocap::kBodyRows + i);
    EXPECT_EQ(model_.rows[row], tree_.moved(i).joint);
    ASSERT_TRUE(model_.limits_rad[row]);
    EXPECT_EQ(model_.limits_rad[row]->lower, tree_.lower()[i]);
    EXPECT_EQ(model_.limits_rad[row]->upper, tree_.upper()[i]);
  }
  std::set<std::string> styles;
  for (const motion::Pattern& p : model_.patterns) styles.insert(p.trial.style);
  EXPECT_EQ(styles, (std::set<std::string>{"slow", "normal", "brisk"}));
  for (const motion::Source& s : model_.learned_from) {
    EXPECT_NE(s.licence.find("mocap.cs.cmu.edu"), std::string::npos);
    EXPECT_EQ(s.sha256.size(), 64U);
  }
}

TEST_F(BipedWalk, KeepsTheLimitsOverACycleOfEachPattern) {
  for (const motion::LimitExcess& row : motion::limit_excess(model_))
    EXPECT_LT(row.beyond_rad, 0.0) << row.row;
  for (int p = 0; p < static_cast<int>(model_.patterns.size()); ++p) {
    CharacterBatch batch = walker(p);
    std::vector<float> before, now;
    double share = 0.0;
    for (int n = 0; n < 400; ++n) {
      batch.step();
      now.assign(batch.angles(0).begin(), batch.angles(0).end());
      EXPECT_EQ(motion::clamp_to_limits(model_, std::span<float>(now)), 0) << p << ' ' << n;
      for (int i = 0; n > 0 && i < tree_.dof(); ++i) {
        const auto r = static_cast<std::size_t>(mocap::kBodyRows + i);
        const double speed = std::abs(double(now[r]) - double(before[r])) * kRate;
        share = std::max(share, speed / tree_.max_speed()[i]);
      }
      before = now;
    }
    EXPECT_LT(share, 1.0) << p;  // share of the joints' largest speeds
  }
}

TEST_F(BipedWalk, WalksAsFastAsItsStylesSay) {
  for (int p = 0; p < static_cast<int>(model_.patterns.size()); ++p) {
    CharacterBatch batch = walker(p);
    double largest = 0.0;
    RootPose before;
    Eigen::Vector2d start = Eigen::Vector2d::Zero();
    for (int n = 0; n < 1400; ++n) {
      batch.step();
      const RootPose root = batch.root(0);
      if (n == 400) start = root.position_W_m;
      if (n > 400) {
        largest = std::max(largest, (root.velocity_H_m_s - before.velocity_H_m_s).norm());
      }
      before = root;
    }
    const mocap::Trial& trial = model_.patterns[static_cast<std::size_t>(p)].trial;
    const double wanted = trial.step_length_m / trial.duration_s;
    EXPECT_NEAR((before.position_W_m - start).norm() / 5.0, wanted, 0.1 * wanted) << trial.style;
    EXPECT_LT(largest, 0.25) << trial.style;  // [m/s] from one step to the next
  }
}

}  // namespace
}  // namespace mimesis::synthesizer
