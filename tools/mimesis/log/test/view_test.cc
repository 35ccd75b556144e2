// Drawings of `mimesis log view`, against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "common/model/drawing.h"
#include "common/model/files.h"
#include "tools/mimesis/log/view_drawings.h"

namespace mimesis::tool {
namespace {

const std::string kModels = std::string(MIMESIS_SOURCE_DIR) + "/models/";

/// Collects drawings by topic.
struct Sheet {
  std::map<std::string, std::vector<std::string>> messages;
  Draw draw = [this](const std::string& topic, const google::protobuf::Message& message,
                     std::chrono::nanoseconds) {
    messages[topic].push_back(message.SerializeAsString());
  };
  template <class T>
  T last(const std::string& topic) const {
    T message;
    EXPECT_TRUE(message.ParseFromString(messages.at(topic).back()));
    return message;
  }
  std::size_t count(const std::string& topic) const {
    return messages.contains(topic) ? messages.at(topic).size() : 0;
  }
};

TEST(ViewFields, CurvesHaveTheHeightOfTheActivityAboveTheirLine) {
  v1::FieldActivity activity;
  for (const char* name : {"STSg", "PFC"}) {
    v1::Field& field = *activity.add_fields();
    field.set_name(name);
    for (const float u : {-3.0F, 0.0F, 10.0F, 100.0F, NAN}) field.add_u(u);
  }
  const auto update = to_board(activity);
  ASSERT_EQ(update.entities_size(), 1);
  const foxglove::SceneEntity& board = update.entities(0);
  EXPECT_EQ(board.frame_id(), "world");
  ASSERT_EQ(board.lines_size(), 4);  // a line at zero and a curve for each
  ASSERT_EQ(board.texts_size(), 2);
  EXPECT_EQ(board.texts(0).text(), "STSg");
  EXPECT_GT(board.texts(0).pose().position().z(), board.texts(1).pose().position().z());
  for (const int i : {0, 2}) {
    const double zero = board.lines(i).points(0).z();
    const auto& curve = board.lines(i + 1);
    ASSERT_EQ(curve.points_size(), 5);
    ASSERT_EQ(curve.colors_size(), 5);
    EXPECT_NEAR(curve.points(0).z() - zero, -0.0225, 1e-12);  // 7.5 mm per unit
    EXPECT_NEAR(curve.points(2).z() - zero, 0.075, 1e-12);
    EXPECT_NEAR(curve.points(3).z() - zero, 0.12, 1e-12);  // cut off at 16
    EXPECT_NEAR(curve.points(4).z() - zero, 0.0, 1e-12);   // NaN
    EXPECT_NEAR(curve.points(4).x() - curve.points(0).x(), 1.2, 1e-12);
  }
  EXPECT_GT(activity_color(5.0).r, activity_color(5.0).b);    // orange
  EXPECT_LT(activity_color(-3.0).r, activity_color(-3.0).b);  // blue
  EXPECT_DOUBLE_EQ(activity_color(0.0).r, activity_color(0.0).b);
}

TEST(ViewCamera, FramesAndCalibrationProjectAsTheCameraDoes) {
  const image::View view;
  const auto calibration = to_calibration(view, {});
  const auto frames = to_camera_frames(view, {});
  ASSERT_EQ(frames.transforms_size(), 2);
  EXPECT_EQ(frames.transforms(0).child_frame_id(), "teacher");
  EXPECT_EQ(frames.transforms(1).parent_frame_id(), "teacher");
  EXPECT_EQ(frames.transforms(1).child_frame_id(), "camera");
  const auto pose = [](const foxglove::FrameTransform& t) {
    Eigen::Isometry3d X(
        Eigen::Translation3d(t.translation().x(), t.translation().y(), t.translation().z()));
    const auto& r = t.rotation();
    X.linear() = Eigen::Quaterniond(r.w(), r.x(), r.y(), r.z()).toRotationMatrix();
    return X;
  };
  const Eigen::Vector3d p_T(0.19, 0.03, 0.0);
  const Eigen::Vector3d p_C = pose(frames.transforms(1)).inverse() * p_T;
  const Eigen::Matrix3d K = Eigen::Map<const Eigen::Matrix3d>(calibration.k().data()).transpose();
  const Eigen::Vector2d pixel = (K * p_C).hnormalized();
  EXPECT_LT((pixel - image::Camera(view).project(p_T)).norm(), 1e-9);
  // Up on the teacher's table is up in the world; his right is the robot's right.
  const Eigen::Isometry3d X_WT = pose(frames.transforms(0));
  EXPECT_LT((X_WT.linear().col(1) - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((X_WT.linear().col(0) + Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_NEAR(X_WT.linear().determinant(), 1.0, 1e-12);
}

TEST(ViewPlan, TheRoadmapIsDrawnForTheFirstSceneAndForPlansThatFindAChange) {
  std::vector<v1::Transport> decisions;
  RoadmapView view([&](const v1::Scene&, const v1::TaskStatus& status) {
    decisions.push_back(status.transport());
    return foxglove::SceneUpdate();
  });
  Sheet sheet;
  v1::Scene scene = model::to_proto(model::load_table(kModels + "bridge_table.yaml"));
  EXPECT_TRUE(view.see(scene, sheet.draw));
  EXPECT_EQ(sheet.count("view/roadmap"), 1u);
  scene.mutable_header()->set_stamp_ns(5);
  EXPECT_TRUE(view.see(scene, sheet.draw));
  v1::TaskStatus status;
  status.set_transport(v1::TRANSPORT_ABOVE);
  EXPECT_TRUE(view.see(status, sheet.draw));  // plans nothing
  EXPECT_EQ(sheet.count("view/roadmap"), 1u);
  status.set_state(v1::TASK_STATE_PLANNING);
  EXPECT_TRUE(view.see(status, sheet.draw));
  EXPECT_TRUE(view.see(status, sheet.draw));
  EXPECT_EQ(sheet.count("view/roadmap"), 2u);  // decided
  scene.mutable_object()->mutable_position_in_world_m()->set_x_m(0.41);
  EXPECT_TRUE(view.see(scene, sheet.draw));
  EXPECT_TRUE(view.see(status, sheet.draw));
  EXPECT_EQ(sheet.count("view/roadmap"), 3u);  // another scene

  scene.mutable_obstacles(0)->set_radius_m(NAN);
  EXPECT_FALSE(view.see(scene, sheet.draw));
  EXPECT_EQ(sheet.count("view/roadmap"), 3u);
  EXPECT_EQ(decisions,
            (std::vector{v1::TRANSPORT_UNSPECIFIED, v1::TRANSPORT_ABOVE, v1::TRANSPORT_ABOVE}));
}

}  // namespace
}  // namespace mimesis::tool
