#include "common/model/viewer.h"

#include <gtest/gtest.h>

#include <map>

#include "common/model/files.h"

namespace mimesis::model {
namespace {

const std::string kModels = std::string(MIMESIS_SOURCE_DIR) + "/models/";

TEST(Viewer, DrawsEveryBallOfTheArmInItsOwnFrame) {
  const kin::ArmModel arm = load_arm(kModels + "lwr4.yaml");
  const kin::Table table = load_table(kModels + "bridge_table.yaml");
  std::map<std::string, foxglove::SceneEntity> entities;
  const auto update = to_entities(table, arm, std::chrono::seconds(3));
  for (const auto& entity : update.entities()) {
    EXPECT_TRUE(entities.emplace(entity.id(), entity).second) << entity.id();
    EXPECT_EQ(entity.timestamp().seconds(), 3);
    EXPECT_TRUE(entity.frame_locked());
  }
  EXPECT_EQ(entities.at("table").cubes_size(), static_cast<int>(table.boxes.size()));
  EXPECT_DOUBLE_EQ(entities.at("table").cubes(0).size().x(), 2 * table.boxes[0].half_extent.x());
  EXPECT_EQ(entities.at("table").spheres_size(),
            static_cast<int>(table.balls.size() + table.goals.size()));
  int balls = 0;
  for (int i = 0; i <= arm.dof(); ++i) {
    const std::string name = "arm/" + std::to_string(i);
    EXPECT_EQ(entities.at(name).frame_id(), name);
    balls += entities.at(name).spheres_size();
  }
  EXPECT_EQ(balls, static_cast<int>(arm.balls.size()));
  EXPECT_DOUBLE_EQ(entities.at("object").cylinders(0).size().z(), table.object_height);
}

TEST(Viewer, TransformsAreThePosesInTheWorld) {
  const kin::ArmModel arm = load_arm(kModels + "lwr4.yaml");
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, arm.home, X);
  const Eigen::Isometry3d X_WO(Eigen::Translation3d(0.1, 0.2, 0.3) *
                               Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()));
  std::map<std::string, foxglove::FrameTransform> frames;
  const auto all =
      to_transforms(arm, X, X_WO, {{"high", {1, 2, 3}, 0.02}}, std::chrono::seconds(1));
  for (const auto& t : all.transforms()) {
    EXPECT_EQ(t.parent_frame_id(), "world");
    frames[t.child_frame_id()] = t;
  }
  EXPECT_EQ(frames.size(), 8u + 1u + 1u + 1u);
  EXPECT_DOUBLE_EQ(frames.at("object").translation().y(), 0.2);
  EXPECT_NEAR(frames.at("object").rotation().x(), std::sin(0.2), 1e-12);
  EXPECT_NEAR(frames.at("object").rotation().w(), std::cos(0.2), 1e-12);
  const Eigen::Vector3d tool = kin::end_effector(arm, arm.home).translation();
  EXPECT_NEAR(frames.at("tool").translation().z(), tool.z(), 1e-12);
  EXPECT_DOUBLE_EQ(frames.at("goal/high").translation().z(), 3.0);

  const auto without_arm = to_transforms(arm, {}, X_WO, {}, std::chrono::seconds(1));
  ASSERT_EQ(without_arm.transforms_size(), 1);
  EXPECT_EQ(without_arm.transforms(0).child_frame_id(), "object");
}

}  // namespace
}  // namespace mimesis::model
