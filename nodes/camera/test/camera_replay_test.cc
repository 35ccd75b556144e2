// A live camera whose device was recorded; one whose device was not is a source.
#include <gtest/gtest.h>

#include "common/error.h"
#include "common/testing/loopback.h"
#include "common/testing/outside_tape.h"
#include "common/testing/refusal.h"
#include "nodes/camera/camera_node.h"
#include "nodes/camera/recorded_device.h"

namespace mimesis::camera {
namespace {

using namespace std::chrono_literals;

/// Absent at first, then frames, one of them damaged, then silence, then unplugged.
class Scripted final : public FrameDevice {
 public:
  tl::expected<std::string, Status> open() override {
    if (opened_++ == 0) return tl::unexpected(Status{"cannot be opened: No such device"});
    return "4x2 YUYV";
  }
  void close() override {}
  tl::expected<void, Status> set_light(Light light) override {
    if (light == Light::followed) return {};
    return tl::unexpected(Status{"gain cannot be locked: Input/output error"});
  }
  Taken take_newest(RawFrame& out) override {
    const int k = asked_++;
    if (k > 60) return Taken::gone;
    if (k > 8) return Taken::none;
    const std::size_t bytes = k == 5 ? 3 : 16;
    out = {PixelFormat::yuyv,
           4,
           2,
           8,
           std::vector<std::uint8_t>(bytes, std::uint8_t(20 * k)),
           std::chrono::milliseconds(100'400 + k)};
    return Taken::frame;
  }

 private:
  int opened_ = 0, asked_ = 0;
};

struct Seen {
  std::vector<std::chrono::nanoseconds> stamps;
  std::vector<std::vector<std::uint8_t>> images;
  std::vector<std::string> news;
  friend bool operator==(const Seen&, const Seen&) = default;
};

Seen watch(Capture& capture) {
  Seen seen;
  for (int k = 0; k < 120; ++k) {
    const auto frame = capture.next(7s + k * 33ms);
    if (frame) seen.stamps.push_back(frame->stamp);
    if (frame) seen.images.push_back(frame->image->bgr);
    if (std::string news = capture.news(); !news.empty()) seen.news.push_back(std::move(news));
  }
  return seen;
}

TEST(RecordedDevice, GivesFramesStampsAndNewsBack) {
  testing::OutsideTape tape;
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  auto clock = [now = 100s + 0ms]() mutable -> std::chrono::nanoseconds { return now += 17ms; };
  Capture live(record_device(std::make_unique<Scripted>(), graph), "/dev/video9",
               record_clock(clock, graph));
  const Seen seen = watch(live);
  EXPECT_EQ(seen.images.size(), 8u);
  ASSERT_GE(seen.news.size(), 4u);
  EXPECT_EQ(seen.news[0], "/dev/video9: cannot be opened: No such device, trying to reopen");
  EXPECT_EQ(seen.news[1], "/dev/video9: frames again");
  EXPECT_NE(seen.news[2].find("3 bytes in rows of 8 are no YUYV frame"), std::string::npos)
      << seen.news[2];
  EXPECT_EQ(seen.news[3], "/dev/video9: no frame for 0.45 s, trying to reopen");

  tape.rewind();
  Capture again(record_device(nullptr, graph), "/dev/video9", record_clock(clock, graph));
  EXPECT_EQ(watch(again), seen);
  EXPECT_EQ(tape.problem(), "");
  EXPECT_TRUE(tape.at_end());
}

TEST(RecordedDevice, HasTheDocumentedBytes) {
  using namespace std::string_literals;
  testing::OutsideTape tape;
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  const auto device = record_device(std::make_unique<Scripted>(), graph);
  EXPECT_FALSE(device->open());
  EXPECT_TRUE(device->open());
  RawFrame frame;
  for (int k = 0; k < 6; ++k) device->take_newest(frame);
  EXPECT_EQ(tape.entries()[0].bytes, "\0cannot be opened: No such device"s);
  EXPECT_EQ(tape.entries()[1].bytes,
            "\x01"
            "4x2 YUYV"s);
  EXPECT_EQ(tape.entries()[7].bytes,
            "\0\0"                              // a frame, yuyv
            "\x04\0\0\0\x02\0\0\0\x08\0\0\0"    // 4 x 2, rows of 8 bytes
            "\x40\xb7\x9a\x60\x17\0\0\0ddd"s);  // 100.405 s
  EXPECT_EQ(record_clock([] { return 258ns; }, graph)(), 258ns);
  EXPECT_EQ(tape.entries().back(),
            (testing::OutsideTape::Entry{"camera_clock", "\x02\x01\0\0\0\0\0\0"s, false}));
}

TEST(RecordedDevice, TellsFromADamagedRecord) {
  testing::OutsideTape tape;
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  tape.rewind();
  const auto device = record_device(nullptr, graph);
  for (const std::string& bad : {std::string("\x07"), std::string("\0\0\x01", 3)}) {
    tape.entries() = {{"camera", bad, false}};
    tape.rewind();
    RawFrame frame;
    EXPECT_THROW(device->take_newest(frame), std::runtime_error);
  }
}

TEST(CameraNode, ALiveCameraWithoutRecordedFramesCannotBeReplayed) {
  testing::OutsideTape tape;
  tape.rewind();
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  CameraParams params;
  params.source = "v4l2";
  params.path = "/dev/video9";
  const std::string why = testing::refusal([&] { CameraNode node(params, graph); });
  EXPECT_EQ(why,
            "source: v4l2 is a live camera, a source of the graph: it can be replayed only if "
            "record_frames was true when the log was recorded");
}

TEST(CameraNode, ALiveCameraKeepsItsFramesOnlyIfAskedTo) {
  for (const bool keep : {false, true}) {
    testing::OutsideTape tape;
    testing::Loopback graph({.lockstep = false, .outside = &tape});
    CameraParams params;
    params.source = "v4l2";
    params.path = graph.directory() + "/no-camera";
    params.record_frames = keep;
    CameraNode node(params, graph);
    node.step(1s);
    EXPECT_EQ(tape.entries().empty(), !keep);
    tape.rewind();
    if (!keep) continue;
    testing::Loopback other({.lockstep = false, .outside = &tape});
    CameraNode again(params, other);
    again.step(1s);
    EXPECT_EQ(tape.problem(), "");
    EXPECT_TRUE(tape.at_end());
  }
}

}  // namespace
}  // namespace mimesis::camera
