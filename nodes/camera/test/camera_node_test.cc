#include "nodes/camera/camera_node.h"

#include <gtest/gtest.h>

#include "common/testing/loopback.h"

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

TEST(CameraNode, RefusesBadParametersWithTheirKey) {
  const auto why = [](const CameraParams& params) -> std::string {
    testing::Loopback bus;
    try {
      CameraNode node(params, bus);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return {};
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
  p.picture.table.bridge_height_m = 0.14;
  EXPECT_EQ(why(p).rfind("bridge_height_m: ", 0), 0u);
}

}  // namespace
}  // namespace mimesis::camera
