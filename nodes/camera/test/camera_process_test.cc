#include <gtest/gtest.h>

#include "common/testing/process.h"
#include "proto/foxglove/image.pb.h"
#include "proto/vision.pb.h"

namespace mimesis::camera {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

constexpr const char* kCamera = MIMESIS_BIN_DIR "/mimesis_camera";

TEST(CameraProcess, SendsImagesWithRisingStampsAndStopsOnRequest) {
  TestGraph graph;
  TestNode peer(graph, {{"image", "camera/image"}, {"truth", "camera/truth"}}, {});
  runtime::Queue<foxglove::RawImage, 8> image(peer.bus(), "image");
  runtime::Queue<v1::TeacherScene, 8> truth(peer.bus(), "truth");
  peer.open();
  Process camera(graph, kCamera, {"--set", "clutter=0", "--set", "teacher=full,below,low"});
  ASSERT_TRUE(camera.wait_ready(graph, "camera", 60s)) << camera.errors();
  std::int64_t before = 0;
  for (int k = 0; k < 5; ++k) {
    const auto m = peer.receive(image, 30s);
    ASSERT_TRUE(m) << camera.errors();
    EXPECT_EQ(m->data().size(), 640u * 480u * 3u);
    const std::int64_t stamp = m->timestamp().seconds() * 1'000'000'000 + m->timestamp().nanos();
    EXPECT_GT(stamp, before);
    before = stamp;
  }
  EXPECT_TRUE(peer.receive(truth, 30s));
  EXPECT_EQ(camera.terminate(), 0) << camera.errors();
}

TEST(CameraProcess, SaysWhatIsWrongWithTheTeacherAndExitsWith2) {
  TestGraph graph;
  Process camera(graph, kCamera, {"--set", "teacher=precise,above,high"});
  EXPECT_EQ(camera.wait(30s), 2);
  EXPECT_NE(camera.errors().find("neither 'precision' nor 'full'"), std::string::npos)
      << camera.errors();
}

TEST(CameraProcess, SaysThatAFilmIsMissingAndExitsWith2) {
  TestGraph graph;
  Process camera(graph, kCamera, {"--set", "source=video", "--set", "path=/no/film.mp4"});
  EXPECT_EQ(camera.wait(30s), 2);
  EXPECT_NE(camera.errors().find("/no/film.mp4"), std::string::npos) << camera.errors();
}

}  // namespace
}  // namespace mimesis::camera
