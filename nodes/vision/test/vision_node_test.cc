#include "nodes/vision/vision_node.h"

#include <gtest/gtest.h>

#include <array>

#include "common/testing/loopback.h"

namespace mimesis::vision {
namespace {

using namespace std::chrono_literals;

/// A grey picture with one rectangle in the object's colour, 640x480.
foxglove::RawImage picture(const std::string& encoding) {
  foxglove::RawImage m;
  m.set_width(640);
  m.set_height(480);
  m.set_step(3 * 640);
  m.set_encoding(encoding);
  std::string data(3 * 640 * 480, '\x96');
  const std::array<char, 3> green{static_cast<char>(80), static_cast<char>(200),
                                  static_cast<char>(70)};
  for (std::size_t v = 200; v < 260; ++v) {
    for (std::size_t u = 100; u < 140; ++u) {
      for (std::size_t c = 0; c < 3; ++c) {
        data[3 * (640 * v + u) + c] = encoding == "rgb8" ? green[2 - c] : green[c];
      }
    }
  }
  m.set_data(data);
  return m;
}

VisionParams params() {
  VisionParams p;
  p.reference_bgr = {0.0, 0.0, 0.0};
  return p;
}

TEST(VisionNode, PublishesWhatItSeesWithTheImagesStamp) {
  testing::Loopback bus;
  VisionNode node(params(), bus);
  for (const std::string encoding : {"bgr8", "rgb8"}) {
    bus.send("image", picture(encoding), 3s);
    node.step(3s + 10ms);
    const auto blobs = bus.take<v1::Blobs>("blobs");
    ASSERT_TRUE(blobs) << encoding;
    EXPECT_EQ(blobs->header().stamp_ns(), 3'000'000'000u);
    ASSERT_EQ(blobs->blobs_size(), 1);
    EXPECT_EQ(blobs->blobs(0).kind(), v1::BLOB_KIND_OBJECT);
    EXPECT_NEAR(blobs->blobs(0).u_px(), 119.5, 1e-9);
    EXPECT_NEAR(blobs->blobs(0).v_px(), 229.5, 1e-9);
    EXPECT_EQ(blobs->blobs(0).area(), 2400);
    const auto scene = bus.take<v1::TeacherScene>("scene");
    ASSERT_TRUE(scene);
    EXPECT_FALSE(scene->complete());  // no bridge, no goals
    EXPECT_LT(scene->object_x_m(), 0.0);
    const auto observation = bus.take<v1::Observation>("observation");
    ASSERT_TRUE(observation);
    EXPECT_EQ(observation->grip(), v1::GRIP_UNSPECIFIED);
    const auto overlay = bus.take<foxglove::ImageAnnotations>("annotations");
    ASSERT_TRUE(overlay);
    EXPECT_EQ(overlay->points_size(), 1);
  }
}

TEST(VisionNode, LooksAtNoImageTwice) {
  testing::Loopback bus;
  VisionNode node(params(), bus);
  bus.send("image", picture("bgr8"), 1s);
  node.step(1s);
  node.step(1s + 16ms);
  EXPECT_TRUE(bus.take<v1::Blobs>("blobs"));
  EXPECT_FALSE(bus.take<v1::Blobs>("blobs"));
}

TEST(VisionNode, RefusesImagesThatAreNotWhatTheySay) {
  testing::Loopback bus;
  VisionNode node(params(), bus);
  std::vector<foxglove::RawImage> wrong(6, picture("bgr8"));
  wrong[0].set_encoding("mono16");
  wrong[1].set_width(320);
  wrong[2].mutable_data()->pop_back();
  wrong[3].set_step(100);
  wrong[4].clear_data();
  wrong[5].set_step(0xffffffffu);
  for (const auto& image : wrong) {
    bus.send("image", image, 1s);
    node.step(1s);
    EXPECT_FALSE(bus.take<v1::Blobs>("blobs"));
    EXPECT_FALSE(bus.take<v1::Observation>("observation"));
  }
  bus.send("image", picture("bgr8"), 2s);
  node.step(2s);
  EXPECT_TRUE(bus.take<v1::Blobs>("blobs"));
}

}  // namespace
}  // namespace mimesis::vision
