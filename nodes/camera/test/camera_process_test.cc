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

TEST(CameraProcess, BadConfigurationExitsWith2) {
  testing::refuses(kCamera, {"teacher=precise,above,high"}, "neither 'precision' nor 'full'");
  testing::refuses(kCamera, {"source=video", "path=/no/film.mp4"}, "/no/film.mp4");
}

#ifndef __SANITIZE_ADDRESS__  // whose runtime must be the first library
/// The program's own way to a camera, through the calls of the kernel (fake_v4l2.c).
TEST(CameraProcess, ACameraUnpluggedForFiveSecondsIsToldAndComesBack) {
  const std::string device = ::testing::TempDir() + "video" + std::to_string(getpid());
  const auto plug = [&] { std::ofstream(device).flush(); };
  plug();
  TestGraph graph;
  TestNode peer(graph, {{"image", "camera/image"}}, {});
  runtime::Queue<foxglove::RawImage, 8> image(peer.bus(), "image");
  peer.open();
  ::setenv("LD_PRELOAD", MIMESIS_FAKE_V4L2, 1);
  ::setenv("MIMESIS_FAKE_CAMERA", device.c_str(), 1);
  Process camera(graph, kCamera,
                 {"--set", "source=v4l2", "--set", "path=" + device, "--set", "light=locked"});
  ::unsetenv("LD_PRELOAD");
  const auto says = [&](const char* words) {
    return peer.until([&] { return camera.errors().find(words) != std::string::npos; }, 30s);
  };
  ASSERT_TRUE(peer.receive(image, 30s)) << camera.errors();
  const auto told = [&] {
    std::ifstream file(device + ".controls");
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  // All automatics on, then each off with the value that it has found.
  const std::string exposure = std::to_string(V4L2_CID_EXPOSURE_AUTO),
                    exposed = std::to_string(V4L2_CID_EXPOSURE_ABSOLUTE);
  EXPECT_TRUE(peer.until([&] { return told().ends_with("=123\n"); }, 30s)) << told();
  EXPECT_TRUE(told().starts_with(exposure + "=3\n")) << told();
  EXPECT_NE(told().find(exposure + "=1\n" + exposed + "=123\n"), std::string::npos) << told();
  EXPECT_EQ(told().find(std::to_string(V4L2_CID_AUTOGAIN) + "="), std::string::npos) << told();
  std::filesystem::remove(device);
  EXPECT_TRUE(says("unplugged, trying to reopen")) << camera.errors();
  while (peer.receive(image, 100ms)) {
  }
  EXPECT_FALSE(peer.receive(image, 5s));
  plug();
  EXPECT_TRUE(peer.receive(image, 30s)) << camera.errors();
  EXPECT_TRUE(says("frames again")) << camera.errors();
  EXPECT_EQ(camera.terminate(), 0) << camera.errors();
  std::filesystem::remove(device);
  std::filesystem::remove(device + ".controls");
}

TEST(CameraProcess, OfSeveralModesOneIsChosenSaidAndListed) {
  const std::string device = ::testing::TempDir() + "modes" + std::to_string(getpid());
  std::ofstream(device).flush();
  TestGraph graph;
  TestNode peer(graph, {{"image", "camera/image"}}, {});
  runtime::Queue<foxglove::RawImage, 8> image(peer.bus(), "image");
  peer.open();
  ::setenv("LD_PRELOAD", MIMESIS_FAKE_V4L2, 1);
  ::setenv("MIMESIS_FAKE_CAMERA", device.c_str(), 1);
  ::setenv("MIMESIS_FAKE_MODES", "YUYV 1280x720 9,GREY 640x480 30,H264 640x480 30", 1);
  Process list("mimesis", {"camera", "list", device, "--json"});
  Process people("mimesis", {"camera", "list", device});
  Process grey(graph, kCamera, {"--set", "source=v4l2", "--set", "path=" + device});
  Process refused(graph, kCamera,
                  {"--name", "other", "--set", "source=v4l2", "--set", "path=" + device, "--set",
                   "format=NV12"});
  ::unsetenv("LD_PRELOAD");
  ::unsetenv("MIMESIS_FAKE_MODES");
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
  const auto says = [&](const Process& camera, const char* words) {
    return peer.until([&] { return camera.errors().find(words) != std::string::npos; }, 30s);
  };
  EXPECT_TRUE(says(grey, "640x480 GREY")) << grey.errors();
  EXPECT_TRUE(says(refused, "offers YUYV, GREY, H264, expected NV12")) << refused.errors();
  std::filesystem::remove(device);
  Process absent("mimesis", {"camera", "list", device});
  EXPECT_EQ(absent.wait(30s), 3);
  EXPECT_NE(absent.errors().find("cannot be opened: No such file"), std::string::npos);
}
#endif

}  // namespace
}  // namespace mimesis::camera
