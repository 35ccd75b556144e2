#include <gtest/gtest.h>

#include <map>

#include "common/model/drawing.h"
#include "common/model/files.h"
#include "common/model/test/model_texts.h"

namespace mimesis::model {
namespace {

TEST(Viewer, DrawsEveryBallOfTheArmInItsOwnFrame) {
  const kin::ArmModel arm = load_arm(kModels + "lwr4.yaml");
  const kin::Table table = load_table(kModels + "bar_table.yaml");
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

/// Ends of a cylinder in W.
std::pair<Eigen::Vector3d, Eigen::Vector3d> ends(const foxglove::CylinderPrimitive& rod,
                                                 const Eigen::Isometry3d& X_WF) {
  const auto& p = rod.pose().position();
  const auto& q = rod.pose().orientation();
  const Eigen::Vector3d half =
      Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()) * Eigen::Vector3d(0, 0, 0.5 * rod.size().z());
  const Eigen::Vector3d center(p.x(), p.y(), p.z());
  return {X_WF * (center - half), X_WF * (center + half)};
}

TEST(Viewer, LinksOfTheRobotReachFromJointToJoint) {
  const kin::ArmModel arm = load_arm(kModels + "lwr4.yaml");
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, arm.home, X);
  std::map<std::string, foxglove::SceneEntity> entities;
  const auto update = to_robot(arm, 0.0, std::chrono::seconds(2));
  for (const auto& entity : update.entities()) {
    entities[entity.id()] = entity;
    EXPECT_EQ(entity.frame_id(), entity.id());
    EXPECT_TRUE(entity.frame_locked());
  }
  EXPECT_EQ(entities.size(), 7u + 1u);
  // Home: q2 tilts the upper arm by 0.6 from the vertical, q4 bends the elbow by 1.6.
  const Eigen::Vector3d shoulder(0.0, 0.0, 0.31);
  const auto [s, e] = ends(entities.at("robot/3").cylinders(0), X[3]);
  EXPECT_LT((s - shoulder).norm(), 1e-12);
  EXPECT_NEAR(e.z(), 0.31 + 0.4 * std::cos(0.6), 1e-12);
  EXPECT_NEAR(e.head<2>().norm(), 0.4 * std::sin(0.6), 1e-12);
  const auto [elbow, wrist] = ends(entities.at("robot/5").cylinders(0), X[5]);
  EXPECT_LT((elbow - e).norm(), 1e-12);
  EXPECT_NEAR((wrist - elbow).norm(), 0.39, 1e-12);
  const double turn = std::acos((e - shoulder).normalized().dot((wrist - elbow).normalized()));
  EXPECT_NEAR(turn, 1.6, 1e-12);
  EXPECT_EQ(entities.at("robot/2").cylinders_size(), 0);  // two joints in one place
  for (const auto& [id, entity] : entities) {
    for (const auto& rod : entity.cylinders()) EXPECT_LT(rod.size().x(), 2 * 0.105);
  }
}

/// An octahedron on link 3: its 8 faces, seen from outside, closed: Σ p₁ · (p₂ × p₃) / 6 is its
/// volume.
TEST(Viewer, AnArmOfPartsIsDrawnAsThese) {
  kin::ArmModel arm = load_arm(kModels + "lwr4.yaml");
  constexpr double kSize_m = 0.1;
  kin::SafetyPart part;
  part.frame = 3;
  part.shape.points.resize(6, 3);
  for (int i = 0; i < 6; ++i)
    part.shape.points.row(i) = (i % 2 ? kSize_m : -kSize_m) * Eigen::RowVector3d::Unit(i / 2);
  arm.parts = {part};
  for (kin::SafetyBall& ball : arm.balls) ball.of_part = ball.frame != 5;
  const auto update = to_robot(arm, 0.0, {});
  ASSERT_EQ(update.entities_size(), 8);
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(update.entities(i).id(), "robot/" + std::to_string(i));
    EXPECT_EQ(update.entities(i).triangles_size(), i == 3);
    EXPECT_EQ(update.entities(i).spheres_size() > 0, i == 5) << "balls that are of no part";
  }
  const auto& points = update.entities(3).triangles(0).points();
  ASSERT_EQ(points.size(), 3 * 8);
  double volume = 0.0;
  for (int i = 0; i < points.size(); i += 3) {
    const auto p = [&](int k) {
      return Eigen::Vector3d(points[i + k].x(), points[i + k].y(), points[i + k].z());
    };
    volume += p(0).dot(p(1).cross(p(2))) / 6.0;
  }
  EXPECT_NEAR(volume, 4.0 / 3.0 * std::pow(kSize_m, 3), 1e-15);
}

TEST(Viewer, FingersTouchWhenTheHandIsClosed) {
  const kin::ArmModel arm = load_arm(kModels + "lwr4.yaml");
  const auto gap_at = [&](double closure) {
    const auto update = to_robot(arm, closure, {});
    const auto& hand = update.entities(update.entities_size() - 1);
    EXPECT_EQ(hand.id(), "robot/tool");
    const auto& left = hand.cylinders(0);
    const auto& right = hand.cylinders(1);
    return right.pose().position().x() - left.pose().position().x() - left.size().x();
  };
  EXPECT_NEAR(gap_at(0.0), 0.058, 1e-12);  // models/README.md
  EXPECT_NEAR(gap_at(0.5), 0.029, 1e-12);
  EXPECT_NEAR(gap_at(1.0), 0.0, 1e-12);
}

TEST(Viewer, FramesOfTheRobotAreThoseOfItsKinematics) {
  const kin::ArmModel arm = load_arm(kModels + "lwr4.yaml");
  std::vector<Eigen::Isometry3d> X;
  kin::forward(arm, arm.home, X);
  const auto frames = to_robot_frames(arm, X, std::chrono::milliseconds(2500));
  ASSERT_EQ(frames.transforms_size(), 8 + 1);
  const auto& tool = frames.transforms(8);
  EXPECT_EQ(tool.child_frame_id(), "robot/tool");
  EXPECT_EQ(tool.parent_frame_id(), "world");
  EXPECT_EQ(tool.timestamp().seconds(), 2);
  EXPECT_EQ(tool.timestamp().nanos(), 500'000'000);
  // Angles from the vertical add up: q2, q4, q6.
  const double upper = 0.6, fore = 0.6 + 1.6, hand = 0.6 + 1.6 + 0.9;
  EXPECT_NEAR(
      tool.translation().z(),
      0.31 + 0.4 * std::cos(upper) + 0.39 * std::cos(fore) + (0.078 + 0.16) * std::cos(hand),
      1e-12);
}

TEST(SceneMessage, CarriesAWholeTableThereAndBack) {
  const kin::Table table = load_table(std::string(MIMESIS_SOURCE_DIR) + "/models/bar_table.yaml");
  const kin::Table back = from_proto(to_proto(table));
  ASSERT_EQ(back.balls.size(), table.balls.size());
  for (std::size_t i = 0; i < table.balls.size(); ++i) {
    EXPECT_EQ(back.balls[i].center, table.balls[i].center);
    EXPECT_EQ(back.balls[i].radius, table.balls[i].radius);
  }
  ASSERT_EQ(back.boxes.size(), table.boxes.size());
  for (std::size_t i = 0; i < table.boxes.size(); ++i) {
    EXPECT_EQ(back.boxes[i].center, table.boxes[i].center);
    EXPECT_EQ(back.boxes[i].half_extent, table.boxes[i].half_extent);
    EXPECT_EQ(back.boxes[i].name, table.boxes[i].name);
  }
  ASSERT_EQ(back.goals.size(), table.goals.size());
  for (std::size_t i = 0; i < table.goals.size(); ++i) {
    EXPECT_EQ(back.goals[i].name, table.goals[i].name);
    EXPECT_EQ(back.goals[i].position, table.goals[i].position);
    EXPECT_EQ(back.goals[i].radius, table.goals[i].radius);
  }
  EXPECT_EQ(back.bar_center, table.bar_center);
  EXPECT_EQ(back.bar_height, table.bar_height);
  EXPECT_EQ(back.bar_half_width, table.bar_half_width);
  EXPECT_EQ(back.object, table.object);
  EXPECT_EQ(back.object_radius, table.object_radius);
  EXPECT_EQ(back.object_height, table.object_height);
}

TEST(SceneMessage, UnknownGoalsStayUnknown) {
  v1::Scene scene;
  scene.add_goals();
  EXPECT_EQ(from_proto(scene).goals.at(0).name, "");
}
}  // namespace
}  // namespace mimesis::model
