#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "common/testing/bad_settings.h"
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

bool says(TestNode& peer, const Process& camera, const char* words) {
  return peer.until([&] { return camera.errors().find(words) != std::string::npos; }, 30s);
}

TEST(CameraProcess, BadConfigurationExitsWith2) {
  testing::refuses(kCamera, {"teacher=precise,above,high"}, "neither 'precision' nor 'full'");
  testing::refuses(kCamera, {"source=video", "path=/no/film.mp4"}, "/no/film.mp4");
}

#ifndef __SANITIZE_ADDRESS__  // whose runtime must be the first library
/// A camera to programs that are started while this lives, through the calls of the kernel
/// (fake_v4l2.cc).
class FakeVideo {
 public:
  explicit FakeVideo(const char* modes = nullptr) {
    plug();
    ::setenv("LD_PRELOAD", MIMESIS_FAKE_V4L2, 1);
    ::setenv("MIMESIS_FAKE_CAMERA", path.c_str(), 1);
    if (modes != nullptr) ::setenv("MIMESIS_FAKE_MODES", modes, 1);
  }
  ~FakeVideo() {
    for (const char* name : {"LD_PRELOAD", "MIMESIS_FAKE_CAMERA", "MIMESIS_FAKE_MODES"}) {
      ::unsetenv(name);
    }
    unplug();
    std::filesystem::remove(path + ".controls");
  }
  FakeVideo(const FakeVideo&) = delete;
  FakeVideo& operator=(const FakeVideo&) = delete;
  void plug() { std::ofstream(path).flush(); }
  void unplug() { std::filesystem::remove(path); }
  /// What it was told to do, a line each: CONTROL=VALUE.
  std::string controls() const {
    std::ifstream file(path + ".controls");
    return std::string(std::istreambuf_iterator<char>(file), {});
  }
  const std::string path = ::testing::TempDir() + "video" + std::to_string(getpid());
};

TEST(CameraProcess, ACameraUnpluggedForFiveSecondsIsToldAndComesBack) {
  FakeVideo video;
  TestGraph graph;
  TestNode peer(graph, {{"image", "camera/image"}}, {});
  runtime::Queue<foxglove::RawImage, 8> image(peer.bus(), "image");
  peer.open();
  Process camera(graph, kCamera,
                 {"--set", "source=v4l2", "--set", "path=" + video.path, "--set", "light=locked"});
  ASSERT_TRUE(peer.receive(image, 30s)) << camera.errors();
  // All automatics on, then each off with the value that it has found.
  const std::string exposure = std::to_string(V4L2_CID_EXPOSURE_AUTO),
                    exposed = std::to_string(V4L2_CID_EXPOSURE_ABSOLUTE);
  EXPECT_TRUE(peer.until([&] { return video.controls().ends_with("=123\n"); }, 30s))
      << video.controls();
  EXPECT_TRUE(video.controls().starts_with(exposure + "=3\n")) << video.controls();
  EXPECT_NE(video.controls().find(exposure + "=1\n" + exposed + "=123\n"), std::string::npos)
      << video.controls();
  EXPECT_EQ(video.controls().find(std::to_string(V4L2_CID_AUTOGAIN) + "="), std::string::npos)
      << video.controls();
  video.unplug();
  EXPECT_TRUE(says(peer, camera, "unplugged, trying to reopen")) << camera.errors();
  while (peer.receive(image, 100ms)) {
  }
  EXPECT_FALSE(peer.receive(image, 5s));
  video.plug();
  EXPECT_TRUE(peer.receive(image, 30s)) << camera.errors();
  EXPECT_TRUE(says(peer, camera, "frames again")) << camera.errors();
  EXPECT_EQ(camera.terminate(), 0) << camera.errors();
}

TEST(CameraProcess, OfSeveralModesOneIsChosenSaidAndListed) {
  FakeVideo video("YUYV 1280x720 9,GREY 640x480 30,H264 640x480 30");
  TestGraph graph;
  TestNode peer(graph, {{"image", "camera/image"}}, {});
  runtime::Queue<foxglove::RawImage, 8> image(peer.bus(), "image");
  peer.open();
  Process list("mimesis", {"camera", "list", video.path, "--json"});
  Process people("mimesis", {"camera", "list", video.path});
  Process grey(graph, kCamera, {"--set", "source=v4l2", "--set", "path=" + video.path});
  Process refused(graph, kCamera,
                  {"--name", "other", "--set", "source=v4l2", "--set", "path=" + video.path,
                   "--set", "format=NV12"});
  EXPECT_EQ(list.wait(30s), 0) << list.errors();
  const std::string told = list.output();
  EXPECT_NE(told.find(R"("card":"Fake camera")"), std::string::npos) << told;
  EXPECT_NE(
      told.find(
          R"({"format":"YUYV","is_read":true,"width_px":1280,"height_px":720,"most_width_px":0,"most_height_px":0,"rate_hz":9.0})"),
      std::string::npos)
      << told;
  EXPECT_NE(told.find(R"({"format":"H264","is_read":false)"), std::string::npos) << told;
  EXPECT_NE(told.find(R"({"name":"Brightness","min":-64,"max":64)"), std::string::npos) << told;
  EXPECT_EQ(people.wait(30s), 0);
  EXPECT_NE(people.output().find("GREY    yes   640x480"), std::string::npos) << people.output();
  const auto picture = peer.receive(image, 30s);
  ASSERT_TRUE(picture) << grey.errors();
  EXPECT_EQ(picture->width(), 640u);
  EXPECT_EQ(picture->data()[0], picture->data()[2]);
  EXPECT_TRUE(says(peer, grey, "640x480 GREY")) << grey.errors();
  EXPECT_TRUE(says(peer, refused, "offers YUYV, GREY, H264, expected NV12")) << refused.errors();
  video.unplug();
  Process absent("mimesis", {"camera", "list", video.path});
  EXPECT_EQ(absent.wait(30s), 3);
  EXPECT_NE(absent.errors().find("cannot be opened: No such file"), std::string::npos);
}
#endif

}  // namespace
}  // namespace mimesis::camera
