#include <gtest/gtest.h>

#include "common/testing/bad_settings.h"
#include "common/testing/process.h"
#include "proto/foxglove/image.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::vision {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

constexpr const char* kVision = MIMESIS_BIN_DIR "/mimesis_vision";

/// A grey picture with a blue rectangle at (300..390, 150..190).
foxglove::RawImage picture() {
  foxglove::RawImage m;
  m.set_width(640);
  m.set_height(480);
  m.set_step(1920);
  m.set_encoding("bgr8");
  std::string data(1920 * 480, static_cast<char>(150));
  for (std::size_t v = 150; v < 190; ++v) {
    for (std::size_t u = 300; u < 390; ++u) {
      data[3 * (640 * v + u)] = static_cast<char>(205);
      data[3 * (640 * v + u) + 1] = static_cast<char>(96);
      data[3 * (640 * v + u) + 2] = static_cast<char>(38);
    }
  }
  m.set_data(data);
  return m;
}

TEST(VisionProcess, AnswersImagesAndSurvivesBadOnes) {
  TestGraph graph;
  TestNode peer(graph, {{"blobs", "vision/blobs"}, {"observation", "vision/observation"}},
                {{"image", "test/image"}});
  runtime::Reliable<v1::Blobs> blobs(peer.bus(), "blobs");
  runtime::Reliable<v1::Observation> observation(peer.bus(), "observation");
  runtime::Out<foxglove::RawImage> image(peer.bus(), "image");
  peer.open();
  Process vision(graph, kVision, {"--in", "image=test/image"});
  ASSERT_TRUE(vision.wait_ready(graph, "vision", 30s)) << vision.errors();
  ASSERT_TRUE(peer.wait_subscriber(image, 30s));

  foxglove::RawImage bad = picture();
  bad.mutable_data()->resize(1000);
  image.send(bad, TestNode::now());
  ASSERT_TRUE(peer.until([&] { return vision.errors().find("too few") != std::string::npos; }, 30s))
      << vision.errors();

  foxglove::RawImage good = picture();
  const auto stamp = TestNode::now();
  image.send(good, stamp);
  const auto seen = peer.receive(blobs, 30s);
  ASSERT_TRUE(seen) << vision.errors();
  EXPECT_EQ(seen->header().stamp_ns(), static_cast<std::uint64_t>(stamp.count()));
  ASSERT_EQ(seen->blobs_size(), 1);
  EXPECT_EQ(seen->blobs(0).kind(), v1::BLOB_KIND_BAR);
  EXPECT_NEAR(seen->blobs(0).u_px(), 344.5, 1e-9);
  const auto told = peer.receive(observation, 30s);
  ASSERT_TRUE(told);
  EXPECT_EQ(told->grip(), v1::GRIP_UNSPECIFIED);
  EXPECT_EQ(vision.terminate(), 0) << vision.errors();
}

TEST(VisionProcess, RefusesAnImpossibleView) {
  testing::refuses(kVision, {"view.eye_m=[0, 1, 0]", "view.target_m=[0, 0, 0]"}, "eye_m");
}

}  // namespace
}  // namespace mimesis::vision
