#include "nodes/camera/camera_node.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/image/image.h"
#include "common/model/files.h"
#include "common/model/rig_file.h"
#include "common/testing/loopback.h"
#include "common/testing/refusal.h"

namespace mimesis::camera {
namespace {

using namespace std::chrono_literals;

TEST(CameraNode, PublishesAnImageAndTheTruthPerStep) {
  testing::Loopback bus;
  CameraNode node(CameraParams{}, bus);
  node.step(2s);
  node.step(2s + 33ms);
  for (const auto stamp : {2'000'000'000u, 2'033'000'000u}) {
    const auto image = bus.take<foxglove::RawImage>("image");
    ASSERT_TRUE(image);
    EXPECT_EQ(image->width(), 640u);
    EXPECT_EQ(image->height(), 480u);
    EXPECT_EQ(image->step(), 1920u);
    EXPECT_EQ(image->encoding(), "bgr8");
    EXPECT_EQ(image->data().size(), 640u * 480u * 3u);
    const auto truth = bus.take<v1::TeacherScene>("truth");
    ASSERT_TRUE(truth);
    EXPECT_EQ(truth->header().stamp_ns(), stamp);
    EXPECT_NEAR(truth->object_x_m(), -0.27, 1e-9);
    EXPECT_TRUE(truth->complete());
  }
}

TEST(CameraNode, TellsItsImagesPackedOnRequest) {
  for (const std::string format : {"png", "jpeg"}) {
    testing::Loopback bus;
    CameraParams params;
    params.packed = format;
    params.stereo = true;
    params.picture.view = {.focal_px = 370.0, .width_px = 320, .height_px = 240};
    CameraNode node(params, bus);
    node.step(2s);
    for (const std::string eye : {"", "right"}) {
      const auto image = bus.take<foxglove::RawImage>(eye.empty() ? "image" : eye);
      const auto packed =
          bus.take<foxglove::CompressedImage>(eye.empty() ? "packed" : "packed_" + eye);
      ASSERT_TRUE(image && packed);
      EXPECT_EQ(packed->format(), format);
      EXPECT_EQ(packed->timestamp().seconds(), 2);
      EXPECT_LT(packed->data().size(), 0.6 * static_cast<double>(image->data().size()));
      const std::string file = ::testing::TempDir() + "packed";
      std::ofstream(file, std::ios::binary) << packed->data();
      const auto read = image::read_image(file);
      ASSERT_TRUE(read) << read.error().reason;
      double off = 0.0;
      for (std::size_t i = 0; i < read->bgr.size(); ++i)
        off += std::abs(read->bgr[i] - static_cast<std::uint8_t>(image->data()[i]));
      off /= static_cast<double>(read->bgr.size());
      EXPECT_LT(off, format == "png" ? 1e-9 : 5.0);
    }
  }
}

TEST(CameraNode, RefusesBadParametersWithTheirKey) {
  const auto why = [](const CameraParams& params) -> std::string {
    testing::Loopback bus;
    return testing::refusal([&] { CameraNode node(params, bus); });
  };
  CameraParams p;
  p.teacher = "precision,over,high";
  EXPECT_NE(why(p).find("'over' is neither 'above' nor 'below'"), std::string::npos);
  p = {};
  p.source = "folder";
  EXPECT_EQ(why(p).rfind("path: ", 0), 0u);
  p.path = "/no/such/folder";
  EXPECT_NE(why(p).find("/no/such/folder"), std::string::npos);
  p = {};
  p.teacher = "precision,below,low";
  p.picture.table.bar_height_m = 0.14;
  EXPECT_EQ(why(p).rfind("bar_height_m: ", 0), 0u);
}

TEST(CameraNode, TwoEyesTellCalibrationAndLessonOnceAndAreOfOneTime) {
  testing::Loopback bus;
  CameraParams p;
  p.stereo = true;
  p.baseline_m = 0.25;
  CameraNode node(p, bus);
  node.step(1s);
  node.step(2s);
  const auto message = bus.take<v1::CameraRig>("rig");
  ASSERT_TRUE(message);
  EXPECT_FALSE(bus.take<v1::CameraRig>("rig"));
  EXPECT_TRUE(bus.take<v1::ColorLesson>("lesson"));
  EXPECT_FALSE(bus.take<v1::ColorLesson>("lesson"));
  const image::Rig rig = model::parse_rig(message->text(), "rig");
  ASSERT_EQ(rig.cameras.size(), 2u);
  EXPECT_NEAR((rig.cameras[1].camera.eye() - rig.cameras[0].camera.eye()).norm(), 0.25, 1e-6);
  for (const auto stamp : {1u, 2u}) {
    const auto left = bus.take<foxglove::RawImage>("image"),
               right = bus.take<foxglove::RawImage>("right");
    ASSERT_TRUE(left && right);
    EXPECT_EQ(left->timestamp().seconds(), stamp);
    EXPECT_EQ(right->timestamp().seconds(), stamp);
    EXPECT_NE(left->data(), right->data());
  }
}

TEST(CameraNode, ARandomSceneIsThatOfItsSeedWithALessonWithinItsImage) {
  const auto first = [](int seed) {
    testing::Loopback bus;
    CameraParams p;
    p.stereo = true;
    p.scene = "random";
    p.seed = seed;
    CameraNode node(p, bus);
    node.step(1s);
    const auto lesson = bus.take<v1::ColorLesson>("lesson");
    EXPECT_TRUE(lesson && lesson->regions_size() == 4);
    for (const v1::ColorRegion& r : lesson->regions()) {
      EXPECT_LE(r.left() + r.width(), 640u);
      EXPECT_LE(r.top() + r.height(), 480u);
    }
    return bus.take<foxglove::RawImage>("image")->data();
  };
  EXPECT_EQ(first(3), first(3));
  EXPECT_NE(first(3), first(4));
}

TEST(RobotRenderer, SeesAllUnlessAStandIsBeforeTheObject) {
  const Eigen::Vector3d origin(0.52, 0.0, -0.01);
  kin::Table table = model::load_table(std::string(MIMESIS_SOURCE_DIR) + "/models/bar_table.yaml");
  image::View view;
  view.eye_m = {0.25, 0.95, 1.0};
  view.target_m = {0.0, 0.2, 0.0};
  EXPECT_TRUE(sees_all(table, origin, view));
  // From a camera far away behind the stand, the stand hides what is beyond its upper face.
  kin::Table hidden = table;
  const Eigen::Vector3d toward = Eigen::Vector3d(1.52, 0.25, 0.94) - table.object;
  for (kin::Box& box : hidden.boxes) {
    if (box.name == "high stand") box.center.head<2>() = (table.object + 0.2 * toward).head<2>();
  }
  EXPECT_FALSE(sees_all(hidden, origin, view));
  view.target_m = {0.6, 0.2, 0.0};  // looks past it
  EXPECT_FALSE(sees_all(table, origin, view));
}

TEST(CameraNode, TheRobotsEyeSeesWhatTheWorldTells) {
  testing::Loopback bus;
  CameraParams p;
  p.source = "robot";
  p.robot = std::string(MIMESIS_SOURCE_DIR) + "/models/lwr4.yaml";
  p.picture.view.eye_m = {0.25, 0.95, 1.0};
  p.picture.view.target_m = {0.0, 0.2, 0.0};
  CameraNode node(p, bus);
  node.step(1s);
  EXPECT_FALSE(bus.take<foxglove::RawImage>("image"));  // the world is not known yet
  const kin::Table table =
      model::load_table(std::string(MIMESIS_SOURCE_DIR) + "/models/bar_table.yaml");
  bus.send("scene", model::to_proto(table), 1s);
  v1::JointState arm;
  for (const double q : model::load_arm(p.robot).home) arm.add_position_rad(q);
  bus.send("joint_states", arm, 1s);
  const auto seen = [&](const Eigen::Vector3d& object, runtime::Time now) {
    v1::WorldState state;
    state.mutable_object_position_in_world_m()->set_x_m(object.x());
    state.mutable_object_position_in_world_m()->set_y_m(object.y());
    state.mutable_object_position_in_world_m()->set_z_m(object.z());
    bus.send("state", state, now);
    node.step(now);
    return bus.take<foxglove::RawImage>("image");
  };
  const auto before = seen(table.object, 2s);
  ASSERT_TRUE(before);
  // The object's green is where the calibration says: the y axis of W points to the right.
  const image::Camera camera =
      model::parse_rig(bus.take<v1::CameraRig>("rig")->text(), "rig").cameras[0].camera;
  const auto green = [&](const foxglove::RawImage& image, const Eigen::Vector3d& p_W) {
    const Eigen::Vector3d off = p_W - Eigen::Vector3d(0.52, 0.0, -0.01);
    const Eigen::Vector2d pixel = camera.project({off.y(), off.z(), off.x()});
    const auto at =
        3 * static_cast<std::size_t>(640 * std::lround(pixel.y()) + std::lround(pixel.x()));
    return static_cast<unsigned char>(image.data()[at + 1]) >
           static_cast<unsigned char>(image.data()[at + 2]) + 40;
  };
  EXPECT_TRUE(green(*before, table.object));
  const Eigen::Vector3d elsewhere = table.object + Eigen::Vector3d(0.0, 0.15, 0.0);
  EXPECT_FALSE(green(*before, elsewhere));
  const auto after = seen(elsewhere, 3s);
  EXPECT_TRUE(green(*after, elsewhere));
  EXPECT_FALSE(green(*after, table.object));
}

}  // namespace
}  // namespace mimesis::camera
