#include "nodes/camera/source/source.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <deque>
#include <fstream>

#include "common/image/image.h"
#include "common/testing/refusal.h"
#include "common/testing/temporary_folder.h"
#include "nodes/camera/source/capture.h"
#include "nodes/camera/source/v4l2.h"

namespace mimesis::camera {
namespace {

using namespace std::chrono_literals;

class Files : public ::testing::Test {
 protected:
  void picture(const std::string& name, std::uint8_t grey) {
    image::Image image(8, 6);
    std::fill(image.bgr.begin(), image.bgr.end(), grey);
    ASSERT_TRUE(image::write_png(folder_ / name, image));
  }
  /// Frames of 16x8 with luma 50, 60, 70 ... and neutral chroma.
  std::string film(int frames, const std::string& header) {
    const std::string path = (folder_ / "film.y4m").string();
    std::ofstream file(path, std::ios::binary);
    file << header << "\n";
    for (int k = 0; k < frames; ++k) {
      file << "FRAME\n" << std::string(16 * 8, static_cast<char>(50 + 10 * k));
      file << std::string(16 * 8 / 2, static_cast<char>(128));
    }
    return path;
  }
  /// A program `ffmpeg`, and a film that only it could read.
  std::string film_for_ffmpeg(const std::string& script) {
    const std::filesystem::path program = folder_ / "ffmpeg", film = folder_ / "film.mp4";
    std::ofstream(program) << "#!/bin/sh\n" << script;
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    std::ofstream(film) << "x";
    return film.string();
  }
  testing::TemporaryFolder folder_;
};

TEST_F(Files, AFolderIsShownInTheOrderOfNamesAtTheRate) {
  picture("b.png", 20);
  picture("a.png", 10);
  picture("c.PNG", 30);
  std::ofstream(folder_ / "notes.txt") << "no picture";
  Sequence sequence(std::make_unique<FolderReader>(folder_), 10.0, 1);
  const auto first = sequence.next(5s);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->image->at(0, 0)[0], 10);
  EXPECT_EQ(first->stamp, 5s);
  EXPECT_FALSE(sequence.next(5s + 50ms));        // not due
  const auto third = sequence.next(5s + 210ms);  // late: the second is left out
  ASSERT_TRUE(third);
  EXPECT_EQ(third->image->at(0, 0)[0], 30);
  EXPECT_EQ(third->stamp, 5s + 200ms);
  EXPECT_FALSE(sequence.next(6s));
  EXPECT_EQ(sequence.news(), "end after 3 pictures");
  EXPECT_EQ(sequence.news(), "");
}

TEST_F(Files, AFolderIsRepeatedAndBadPicturesAreReported) {
  picture("a.png", 10);
  std::ofstream(folder_ / "b.png") << "damaged";
  Sequence sequence(std::make_unique<FolderReader>(folder_), 10.0, 2);
  EXPECT_TRUE(sequence.next(0s));
  EXPECT_FALSE(sequence.next(100ms));
  EXPECT_NE(sequence.news().find("b.png"), std::string::npos);
  const auto again = sequence.next(200ms);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->image->at(0, 0)[0], 10);
}

TEST_F(Files, AFolderWithoutPicturesIsRefused) {
  EXPECT_NE(testing::refusal([&] { FolderReader r(folder_); }).find("holds no"), std::string::npos);
  EXPECT_NE(testing::refusal([&] { FolderReader r(folder_ / "absent"); }).find("absent"),
            std::string::npos);
}

TEST(Y4m, HeaderGivesSizeAndRate) {
  const auto h = parse_y4m_header("YUV4MPEG2 W640 H480 F30000:1001 Ip A1:1 C420jpeg");
  ASSERT_TRUE(h);
  EXPECT_EQ(h->width, 640);
  EXPECT_EQ(h->height, 480);
  EXPECT_NEAR(h->rate_hz, 29.97, 0.001);
  for (const char* bad : {"", "RIFF", "YUV4MPEG2 W640 F30:1", "YUV4MPEG2 W640 H480",
                          "YUV4MPEG2 W640 H480 F30:0", "YUV4MPEG2 W-2 H480 F30:1",
                          "YUV4MPEG2 W640 H480 F30:1 C444", "YUV4MPEG2 W640 H480 F30:1 C420p10"}) {
    EXPECT_FALSE(parse_y4m_header(bad)) << bad;
  }
}

TEST_F(Files, AFilmIsReadFrameByFrameAndAgain) {
  FilmReader reader(film(3, "YUV4MPEG2 W16 H8 F25:1 C420jpeg"));
  EXPECT_EQ(reader.rate_hz(), 25.0);
  image::Image image;
  for (int pass = 0; pass < 2; ++pass) {
    for (int k = 0; k < 3; ++k) {
      const auto read = reader.read(image);
      ASSERT_TRUE(read && *read);
      EXPECT_EQ(image.width, 16);
      EXPECT_NEAR(image.at(5, 5)[0], 1.164 * (50 + 10 * k - 16), 1.5);  // BT.601, studio range
      EXPECT_EQ(image.at(5, 5)[0], image.at(5, 5)[2]);
    }
    const auto end = reader.read(image);
    ASSERT_TRUE(end);
    EXPECT_FALSE(*end);
    reader.rewind();
  }
}

TEST_F(Files, AFilmThatIsNoneIsRefused) {
  EXPECT_NE(testing::refusal([&] { FilmReader r(film(1, "no film")); }).find("not a Y4M"),
            std::string::npos);
  EXPECT_NE(
      testing::refusal([&] { FilmReader r((folder_ / "absent.mp4").string()); }).find("absent.mp4"),
      std::string::npos);
}

/// Puts a folder first on PATH, alone or before the old one.
class Path {
 public:
  Path(const std::filesystem::path& folder, bool alone) : before_(getenv("PATH")) {
    setenv("PATH", (folder.string() + (alone ? "" : ":" + before_)).c_str(), 1);
  }
  ~Path() { setenv("PATH", before_.c_str(), 1); }

 private:
  std::string before_;
};

TEST_F(Files, AnyFilmIsReadThroughTheProgramFfmpeg) {
  const std::string y4m = film(3, "YUV4MPEG2 W16 H8 F25:1 C420jpeg");
  const std::string mp4 = film_for_ffmpeg("exec cat '" + y4m + "'\n");
  const Path path(folder_, false);
  FilmReader reader(mp4);
  EXPECT_EQ(reader.rate_hz(), 25.0);
  image::Image image;
  int pictures = 0;
  for (auto read = reader.read(image); read && *read; read = reader.read(image)) ++pictures;
  EXPECT_EQ(pictures, 3);
}

TEST_F(Files, AFilmThatFfmpegRefusesGivesItsFirstComplaint) {
  const auto mp4 = film_for_ffmpeg("echo 'film.mp4: Invalid data' >&2\necho more >&2\nexit 1\n");
  const Path path(folder_, false);
  const std::string why = testing::refusal([&] { FilmReader r(mp4); });
  EXPECT_NE(why.find("ffmpeg: film.mp4: Invalid data"), std::string::npos) << why;
  EXPECT_EQ(why.find('\n'), std::string::npos);
}

TEST_F(Files, WithoutTheProgramFfmpegThereIsOneLine) {
  const std::string file = (folder_ / "film.mp4").string();
  std::ofstream(file) << "x";
  const Path path(folder_, true);
  const std::string why = testing::refusal([&] { FilmReader r(file); });
  EXPECT_NE(why.find("needs the program ffmpeg"), std::string::npos) << why;
}

/// A camera with frames from the test.
struct FakeCamera {
  bool present = true;
  bool gone = false;
  std::deque<RawFrame> frames;
  int opened = 0, closed = 0;
  std::string refuses_light;
  std::vector<Light> lights;
};

class FakeDevice final : public FrameDevice {
 public:
  explicit FakeDevice(FakeCamera& camera) : camera_(camera) {}
  tl::expected<std::string, Status> open() override {
    if (!camera_.present) return tl::unexpected(Status{"cannot be opened: No such device"});
    ++camera_.opened;
    return "4x2 YUYV, 30 Hz";
  }
  void close() override { ++camera_.closed; }
  tl::expected<void, Status> set_light(Light light) override {
    camera_.lights.push_back(light);
    if (camera_.refuses_light.empty()) return {};
    return tl::unexpected(Status{camera_.refuses_light});
  }
  Taken take_newest(RawFrame& out) override {
    if (camera_.gone) return Taken::gone;
    if (camera_.frames.empty()) return Taken::none;
    out = camera_.frames.back();
    camera_.frames.clear();
    return Taken::frame;
  }

 private:
  FakeCamera& camera_;
};

std::chrono::nanoseconds g_monotonic{};  // the fake's monotonic clock
std::chrono::nanoseconds monotonic() { return g_monotonic; }

class LiveCamera : public ::testing::Test {
 protected:
  void SetUp() override { g_monotonic = 100s; }
  RawFrame frame(std::chrono::nanoseconds captured) {
    return {PixelFormat::yuyv, 4, 2, 8, std::vector<std::uint8_t>(16, 128), captured};
  }
  std::optional<Frame> after(std::chrono::nanoseconds wait) {
    g_monotonic += wait;
    graph_ += wait;
    return capture_.next(graph_);
  }
  /// Of six frames, each stamped so long before it is taken, those seen as taken on arrival.
  int seen_on_arrival(std::chrono::nanoseconds age, std::chrono::nanoseconds grows = 0ms) {
    int seen = 0;
    for (int k = 0; k < 6; ++k, age += grows) {
      camera_.frames = {frame(g_monotonic + 33ms - age)};
      if (const auto got = after(33ms); got && got->stamp == graph_) ++seen;
    }
    return seen;
  }
  std::chrono::nanoseconds graph_ = 7s;
  FakeCamera camera_;
  Capture capture_{std::make_unique<FakeDevice>(camera_), "/dev/video9", monotonic};
};

TEST_F(LiveCamera, GivesTheNewestFrameWithTheDriversStamp) {
  camera_.frames = {frame(100s - 70ms), frame(100s - 36ms), frame(100s - 3ms)};
  const auto newest = after(0ms);
  ASSERT_TRUE(newest);
  EXPECT_EQ(newest->stamp, 7s - 3ms);
  EXPECT_EQ(newest->image->width, 4);
  EXPECT_EQ(capture_.opened(), "/dev/video9: 4x2 YUYV, 30 Hz");
  EXPECT_EQ(capture_.opened(), "");
  EXPECT_FALSE(after(10ms));  // never the same twice
}

TEST_F(LiveCamera, ReportsAnUnpluggedCameraAtOnceAndReopensIt) {
  camera_.frames = {frame(100s)};
  ASSERT_TRUE(after(0ms));
  camera_.gone = true;
  camera_.present = false;
  EXPECT_FALSE(after(33ms));
  EXPECT_EQ(capture_.news(), "/dev/video9: unplugged, trying to reopen");
  for (int k = 0; k < 90; ++k) EXPECT_FALSE(after(33ms));
  EXPECT_EQ(capture_.news(), "");  // said once
  EXPECT_EQ(camera_.opened, 1);
  camera_.present = true;
  camera_.gone = false;
  bool back = false;
  for (int k = 0; k < 20 && !back; ++k) {
    camera_.frames = {frame(g_monotonic)};
    back = after(33ms).has_value();
  }
  EXPECT_TRUE(back);  // within 0.66 s
  EXPECT_EQ(capture_.news(), "/dev/video9: frames again");
}

TEST_F(LiveCamera, ReportsSilenceWithinHalfASecond) {
  camera_.frames = {frame(100s)};
  ASSERT_TRUE(after(0ms));
  std::chrono::nanoseconds waited{};
  std::string news;
  while (news.empty() && waited < 2s) {
    EXPECT_FALSE(after(33ms));
    waited += 33ms;
    news = capture_.news();
  }
  EXPECT_NE(news.find("no frame"), std::string::npos);
  EXPECT_LE(waited, 500ms);
}

TEST_F(LiveCamera, LocksTheLightWhenFramesHaveComeForASecondEachTimeItIsOpened) {
  EXPECT_TRUE(camera_.lights.empty());
  capture_ =
      Capture(std::make_unique<FakeDevice>(camera_), "/dev/video9", monotonic, Light::locked);
  const auto run = [&](int frames) {
    for (int k = 0; k < frames; ++k) {
      camera_.frames = {frame(g_monotonic)};
      after(33ms);
    }
  };
  const std::vector<Light> once{Light::followed, Light::locked};
  run(30);
  EXPECT_EQ(camera_.lights, std::vector{Light::followed});
  run(30);
  EXPECT_EQ(camera_.lights, once);
  camera_.gone = true;
  after(33ms);
  camera_.gone = false;
  camera_.refuses_light = "exposure cannot be locked: Input/output error";
  run(100);
  EXPECT_EQ(camera_.lights.size(), 4u);
  EXPECT_EQ(capture_.news(), "/dev/video9: exposure cannot be locked: Input/output error");
}

/// Drivers stamp by the wall clock, by a host's, or not at all.
TEST_F(LiveCamera, StampsOfAnotherClockAreReplacedByTheTimeOfArrival) {
  EXPECT_EQ(seen_on_arrival(-1'700'000'000s), 4);  // from the third on
  EXPECT_EQ(capture_.news(),
            "/dev/video9: the driver's stamps are 1.7e+09 s ahead of the monotonic clock: images "
            "are stamped when they arrive");
  EXPECT_EQ(seen_on_arrival(-1'700'000'000s), 6);
  EXPECT_EQ(capture_.news(), "");
}

TEST_F(LiveCamera, StampsThatStandStillAreReplacedAndSaid) {
  EXPECT_EQ(seen_on_arrival(0ms, 33ms), 4);  // the first, and those after three equal ones
  EXPECT_NE(capture_.news().find("stamps stand still"), std::string::npos);
}

/// bcm2835-camera took a second off: 640x480 came 0.9 s old [raspberrypi/linux#1318].
TEST_F(LiveCamera, StampsThatLagAreReplacedAndSaid) {
  EXPECT_EQ(seen_on_arrival(900ms), 4);
  EXPECT_EQ(capture_.news(),
            "/dev/video9: the driver's stamps are 0.9 s behind the monotonic clock: images are "
            "stamped when they arrive");
}

/// Polled once in 0.8 s, each frame has lain there for so long: its stamp is right.
TEST_F(LiveCamera, FramesThatWaitedForASlowNodeKeepTheirStamps) {
  EXPECT_FALSE(after(0ms));  // opened
  for (int k = 0; k < 6; ++k) {
    camera_.frames = {frame(g_monotonic + 10ms)};
    const auto got = after(800ms);
    ASSERT_TRUE(got) << k;
    EXPECT_EQ(got->stamp, graph_ - 790ms);
  }
  EXPECT_EQ(capture_.news(), "");
}

/// A frame that lay in the driver while this process was held up is no new picture.
TEST_F(LiveCamera, AnOldFrameIsLeftOutAndTheNextOneCounts) {
  camera_.frames = {frame(g_monotonic - 3s)};
  EXPECT_FALSE(after(0ms));
  camera_.frames = {frame(g_monotonic)};
  const auto next = after(33ms);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->stamp, graph_ - 33ms);
  EXPECT_EQ(capture_.news(), "");
}

TEST_F(LiveCamera, LeavesOutTruncatedFrames) {
  RawFrame cut = frame(100s);
  cut.bytes.resize(9);
  camera_.frames = {cut};
  EXPECT_FALSE(after(0ms));
  EXPECT_NE(capture_.news().find("left out"), std::string::npos);
  camera_.frames = {frame(100s)};
  EXPECT_TRUE(after(33ms));
}

TEST(Decode, YuyvTakesTheRowsLengthAndJpegTheWholePicture) {
  RawFrame raw{PixelFormat::yuyv, 2, 2, 8, {}, {}};
  raw.bytes = {235, 128, 16, 128, 9, 9, 9, 9, 16, 128, 235, 128, 9, 9, 9, 9};
  image::Image image;
  ASSERT_TRUE(decode(raw, image));
  EXPECT_EQ(image.at(0, 0)[1], 255);
  EXPECT_EQ(image.at(1, 0)[1], 0);
  EXPECT_EQ(image.at(0, 1)[1], 0);
  EXPECT_EQ(image.at(1, 1)[1], 255);
  raw.format = PixelFormat::mjpeg;
  EXPECT_FALSE(decode(raw, image));  // these bytes are no JPEG
}

/// A picture of 4 x 4 pixels, red above blue, in each layout.
TEST(Decode, EveryLayoutGivesTheSamePicture) {
  constexpr std::uint8_t kRedY = 81, kRedU = 90, kRedV = 240, kBlueY = 41, kBlueU = 240,
                         kBlueV = 110;
  const auto packed = [&](std::array<int, 4> at) {  // places of Y, U, Y, V in four bytes
    std::vector<std::uint8_t> bytes;
    for (int pair = 0; pair < 8; ++pair) {
      const bool red = pair < 4;
      std::array<std::uint8_t, 4> four{};
      four[std::size_t(at[0])] = four[std::size_t(at[2])] = red ? kRedY : kBlueY;
      four[std::size_t(at[1])] = red ? kRedU : kBlueU;
      four[std::size_t(at[3])] = red ? kRedV : kBlueV;
      bytes.insert(bytes.end(), four.begin(), four.end());
    }
    return bytes;
  };
  std::vector<std::uint8_t> nv12(8, kRedY), yu12;
  nv12.insert(nv12.end(), 8, kBlueY);
  yu12 = nv12;
  nv12.insert(nv12.end(), {kRedU, kRedV, kRedU, kRedV, kBlueU, kBlueV, kBlueU, kBlueV});
  yu12.insert(yu12.end(), {kRedU, kRedU, kBlueU, kBlueU, kRedV, kRedV, kBlueV, kBlueV});
  std::vector<std::uint8_t> rgb;
  for (int k = 0; k < 16; ++k) {
    const bool red = k < 8;
    rgb.insert(rgb.end(), {std::uint8_t(red ? 254 : 0), 0, std::uint8_t(red ? 0 : 254)});
  }
  struct Case {
    PixelFormat format;
    int row_bytes;
    std::vector<std::uint8_t> bytes;
  };
  for (const Case& c :
       {Case{PixelFormat::yuyv, 8, packed({0, 1, 2, 3})},
        Case{PixelFormat::uyvy, 8, packed({1, 0, 3, 2})},
        Case{PixelFormat::yvyu, 8, packed({0, 3, 2, 1})}, Case{PixelFormat::nv12, 4, nv12},
        Case{PixelFormat::yu12, 4, yu12}, Case{PixelFormat::rgb3, 12, rgb}}) {
    image::Image image;
    ASSERT_TRUE(decode({c.format, 4, 4, c.row_bytes, c.bytes, {}}, image)) << int(c.format);
    for (const int x : {0, 3}) {
      EXPECT_NEAR(image.at(x, 0)[2], 254, 4) << int(c.format);
      EXPECT_NEAR(image.at(x, 0)[0], 0, 4) << int(c.format);
      EXPECT_NEAR(image.at(x, 3)[0], 254, 4) << int(c.format);
      EXPECT_NEAR(image.at(x, 3)[2], 0, 4) << int(c.format);
    }
    std::vector<std::uint8_t> cut = c.bytes;
    cut.pop_back();
    EXPECT_FALSE(decode({c.format, 4, 4, c.row_bytes, cut, {}}, image)) << int(c.format);
  }
}

/// Red alone behind the filters of a sensor: the pattern tells where red lies.
TEST(Decode, BayerPatternsAreTakenByTheirFirstRow) {
  struct Case {
    PixelFormat format;
    int red_x, red_y;
  };
  for (const Case& c : {Case{PixelFormat::rggb, 0, 0}, Case{PixelFormat::grbg, 1, 0},
                        Case{PixelFormat::gbrg, 0, 1}, Case{PixelFormat::bggr, 1, 1}}) {
    std::vector<std::uint8_t> bytes(64, 0);
    for (int y = c.red_y; y < 8; y += 2) {
      for (int x = c.red_x; x < 8; x += 2) bytes[std::size_t(8 * y + x)] = 200;
    }
    image::Image image;
    ASSERT_TRUE(decode({c.format, 8, 8, 8, bytes, {}}, image));
    EXPECT_NEAR(image.at(4, 4)[2], 200, 2) << int(c.format);
    EXPECT_EQ(image.at(4, 4)[0], 0) << int(c.format);
  }
}

// Modes of cameras that people reported.
TEST(CameraModes, ARawFormatThatIsTooSlowGivesWayToMjpg) {  // lagadic/visp#931
  const std::vector<CameraMode> modes{{"MJPG", 1280, 720, 0, 0, 60},
                                      {"MJPG", 640, 480, 0, 0, 120},
                                      {"YUYV", 1280, 720, 0, 0, 9},
                                      {"YUYV", 640, 480, 0, 0, 30}};
  EXPECT_EQ(choose_mode(modes, {.width = 1280, .height = 720}), &modes[0]);
  EXPECT_EQ(choose_mode(modes, {.width = 640, .height = 480}), &modes[3]);
  EXPECT_EQ(choose_mode(modes, {.format = "YUYV", .width = 1280, .height = 720}), &modes[2]);
  EXPECT_EQ(choose_mode(modes, {.width = 1280, .height = 720, .rate_hz = 5}), &modes[2]);
  EXPECT_EQ(choose_mode(modes, {.format = "NV12"}), nullptr);
  const std::vector<CameraMode> slow{{"YUYV", 1280, 720, 0, 0, 5}, {"MJPG", 1280, 720, 0, 0, 9}};
  EXPECT_EQ(choose_mode(slow, {.width = 1280, .height = 720, .rate_hz = 30}), &slow[1]);
}

TEST(CameraModes, CamerasThatOfferOneFormatAreTaken) {
  for (const char* fourcc : {"YVYU",     // pikvm/ustreamer#252
                             "NV12",     // ros-drivers/usb_cam#348
                             "GRBG",     // ros-drivers/usb_cam#213
                             "UYVY",     // saki4510t/UVCCamera#653
                             "YU12"}) {  // ros-drivers/usb_cam#341: sizes from 32x32 up
    const std::vector<CameraMode> modes{{"Y10", 640, 480, 0, 0, 30},
                                        {fourcc, 32, 32, 3280, 2464, 0}};
    EXPECT_EQ(choose_mode(modes, {}), &modes[1]) << fourcc;
    EXPECT_TRUE(format_of(fourcc)) << fourcc;
  }
  EXPECT_FALSE(format_of("H264"));
}

TEST(V4l2Device, ThatDoesNotExistOrIsNoCameraIsRefusedWithTheReason) {
  const auto absent = v4l2_device("/dev/mimesis-no-camera", {})->open();
  ASSERT_FALSE(absent);
  EXPECT_NE(absent.error().reason.find("No such file"), std::string::npos);
  const auto null = v4l2_device("/dev/null", {})->open();
  ASSERT_FALSE(null);
  EXPECT_NE(null.error().reason.find("is no camera"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::camera
