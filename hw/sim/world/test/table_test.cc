// The table of models/bar_table.yaml makes the bridge paradigm possible [M18 2.1.1].
#include <gtest/gtest.h>

#include "common/model/files.h"
#include "hw/sim/world/test/postures.h"
#include "hw/sim/world/world.h"

namespace mimesis::world {
namespace {

constexpr double kClearance = 0.004;  // [m]
constexpr int kAttempts = 400;

kin::ArmModel table_arm() {
  return model::load_arm(std::string(MIMESIS_SOURCE_DIR) + "/models/lwr4.yaml");
}

/// With every ball that much larger, free means free with clearance.
kin::ArmModel grown_arm() {
  kin::ArmModel grown = table_arm();
  for (kin::SafetyBall& ball : grown.balls) ball.radius += kClearance;
  return grown;
}

kin::Table low_table(std::optional<double> bar_height = {}) {
  return model::load_table(std::string(MIMESIS_SOURCE_DIR) + "/models/bar_table.yaml", bar_height);
}

const kin::GoalPlace& goal(const kin::Table& t, const std::string& name) {
  return *std::find_if(t.goals.begin(), t.goals.end(),
                       [&](const auto& g) { return g.name == name; });
}

std::size_t places(const kin::Table& t, Grip grip, const std::string& name) {
  return PostureSearch(grown_arm(), t).places(grip, kAttempts, goal(t, name).position).size();
}

TEST(BarTable, BothGripsReachTheObjectAndTheJudgeAgrees) {
  const kin::Table t = low_table();
  const Cylinder object{.X_WO = Eigen::Isometry3d(Eigen::Translation3d(t.object)),
                        .radius = t.object_radius,
                        .height = t.object_height};
  for (const Grip grip : {Grip::precision, Grip::full}) {
    const std::vector<Reach> reaches = PostureSearch(grown_arm(), t).grasps(grip, kAttempts);
    EXPECT_GE(reaches.size(), 10u);
    for (const Reach& reach : reaches) {
      EXPECT_TRUE(
          grasp_contact({}, grip, kin::end_effector(table_arm(), reach.at), object).reachable);
      EXPECT_FALSE(
          grasp_contact({}, grip, kin::end_effector(table_arm(), reach.before), object).reachable);
    }
  }
}

TEST(BarTable, TheHighGoalIsReachedFromAbove) {
  EXPECT_GE(places(low_table(), Grip::precision, "high"), 10u);
}

TEST(BarTable, TheLowGoalIsReachedWithAFullGripOnly) {
  EXPECT_GE(places(low_table(), Grip::full, "low"), 10u);
  EXPECT_EQ(places(low_table(), Grip::precision, "low"), 0u);
}

TEST(BarTable, ALowBarTurnsThatAround) {
  EXPECT_GE(places(low_table(0.20), Grip::precision, "low"), 10u);
  EXPECT_EQ(places(low_table(0.20), Grip::full, "low"), 0u);
}

TEST(BarTable, HomeIsFreeAndFarFromTheObject) {
  const PostureSearch search(grown_arm(), low_table());
  EXPECT_TRUE(search.is_free(table_arm().home, {}, false, false));
}

/// The judge here searches postures by itself, and knows what a hand can do with the object.
TEST(RandomTable, LeavesTheObjectAndTheHighGoalWithinReach) {
  for (std::uint64_t seed = 70; seed < 76; ++seed) {
    const kin::Table t = random_table(table_arm(), low_table(), seed);
    EXPECT_GT(places(t, Grip::precision, "high"), 0u) << seed;
    EXPECT_GT(PostureSearch(grown_arm(), t).places(Grip::precision, kAttempts, t.object).size(), 0u)
        << seed;
    EXPECT_EQ(t.object, random_table(table_arm(), low_table(), seed).object);
  }
}

TEST(RandomTable, SaysWhatIsOutOfReach) {
  EXPECT_EQ(out_of_reach(table_arm(), low_table()), "");
  kin::Table far = low_table();
  far.object.x() += 0.03;  // the fore arm would touch the bar on the way down
  EXPECT_EQ(out_of_reach(table_arm(), far), "the object");
  kin::Table high = low_table();
  high.goals[0].position += Eigen::Vector3d(0.02, 0.0, 0.02);
  EXPECT_EQ(out_of_reach(table_arm(), high), "the high goal");
}

}  // namespace
}  // namespace mimesis::world
