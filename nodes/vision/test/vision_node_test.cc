#include "nodes/vision/vision_node.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "common/error.h"
#include "common/model/rig_file.h"
#include "common/runtime/log.h"
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
    EXPECT_FALSE(scene->complete());  // no bar, no goals
    EXPECT_LT(scene->object_x_m(), 0.0);
    const auto observation = bus.take<v1::Observation>("observation");
    ASSERT_TRUE(observation);
    EXPECT_EQ(observation->grip(), v1::GRIP_UNSPECIFIED);
    const auto overlay = bus.take<foxglove::ImageAnnotations>("annotations");
    ASSERT_TRUE(overlay);
    EXPECT_EQ(overlay->points_size(), 1);
  }
}

TEST(VisionNode, ReadsACamerasYuyv) {
  testing::Loopback bus;
  VisionNode node(params(), bus);
  foxglove::RawImage m = picture("bgr8");
  m.set_encoding("yuyv");
  m.set_step(2 * 640);
  std::string data;
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; u += 2) {
      // Grey, and the rectangle's green: Y 129, U 103, V 90 (BT.601, 16..235).
      const bool green = v >= 200 && v < 260 && u >= 100 && u < 140;
      for (const int byte : green ? std::array{129, 103, 129, 90} : std::array{145, 128, 145, 128})
        data += static_cast<char>(byte);
    }
  }
  m.set_data(data);
  bus.send("image", m, 3s);
  node.step(3s);
  const auto blobs = bus.take<v1::Blobs>("blobs");
  ASSERT_TRUE(blobs);
  ASSERT_EQ(blobs->blobs_size(), 1);
  EXPECT_EQ(blobs->blobs(0).kind(), v1::BLOB_KIND_OBJECT);
  EXPECT_EQ(blobs->blobs(0).area(), 2400);
  m.mutable_data()->pop_back();
  bus.send("image", m, 4s);
  node.step(4s);
  EXPECT_FALSE(bus.take<v1::Blobs>("blobs"));
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

/// A rig of one camera in place of the default view, through a lens that bends.
class VisionRig : public ::testing::Test {
 protected:
  VisionRig() : rig_{"2026-06-01", "9x6", image::Rig::Frame::table, 12, 0.1, {}} {
    const image::Camera straight{image::View{}};
    image::Lens lens = straight.lens();
    lens.distortion = {-0.2, 0.05, 0.001, -0.001, 0.0};
    rig_.cameras.push_back({"teacher", {lens, straight.R_CT(), straight.eye()}, 0.2});
  }
  VisionParams with_rig() {
    file_ = ::testing::TempDir() + "vision_rig.yaml";
    std::ofstream(file_) << model::rig_text(rig_);
    VisionParams p = params();
    p.rig = file_;
    return p;
  }
  void TearDown() override { std::filesystem::remove(file_); }

  image::Rig rig_;
  std::string file_;
};

TEST_F(VisionRig, PutsThingsWhereTheLensSawThem) {
  testing::Loopback straight_bus, bus;
  VisionNode straight(params(), straight_bus);
  straight_bus.send("image", picture("bgr8"), 3s);
  straight.step(3s);
  const auto without = straight_bus.take<v1::TeacherScene>("scene");
  VisionNode node(with_rig(), bus);
  bus.send("image", picture("bgr8"), 4s);
  node.step(4s);
  const auto scene = bus.take<v1::TeacherScene>("scene");
  ASSERT_TRUE(scene && without);
  // The blob's centre is 200 px left of the optical axis: the straight view takes it for nearer to
  // the middle than it is.
  const Eigen::Vector3d p(scene->object_x_m(), scene->object_y_m(), 0.0);
  EXPECT_LT((rig_.cameras[0].camera.project(p) - Eigen::Vector2d(119.5, 229.5)).norm(), 1.0);
  EXPECT_LT(scene->object_x_m(), without->object_x_m() - 0.003);
}

TEST_F(VisionRig, RefusesAnotherSizeCameraFrameOrVersion) {
  testing::Loopback bus;
  VisionParams p = with_rig();
  p.camera = "robot";
  EXPECT_THROW(VisionNode(p, bus), ConfigError);
  rig_.frame = image::Rig::Frame::camera;
  EXPECT_THROW(VisionNode(with_rig(), bus), ConfigError);
  rig_.frame = image::Rig::Frame::table;
  image::Lens wide = rig_.cameras[0].camera.lens();
  wide.width_px = 800;
  rig_.cameras[0].camera = {wide, rig_.cameras[0].camera.R_CT(), rig_.cameras[0].camera.eye()};
  VisionNode node(with_rig(), bus);
  bus.send("image", picture("bgr8"), 1s);
  node.step(1s);
  EXPECT_FALSE(bus.take<v1::Blobs>("blobs"));
}

TEST_F(VisionRig, RefusesImagesLongAfterTheCalibration) {
  testing::Loopback bus;
  VisionParams p = with_rig();
  p.rig_days = 30;
  VisionNode node(p, bus);
  const auto day = *model::day_number(rig_.date);
  const auto seen = [&](int days) {
    const auto stamp = std::chrono::days(day + days) + 5h;
    bus.send("image", picture("bgr8"), stamp);
    node.step(stamp);
    return bus.take<v1::Blobs>("blobs").has_value();
  };
  EXPECT_TRUE(seen(0));
  EXPECT_TRUE(seen(30));
  EXPECT_FALSE(seen(31));
  EXPECT_TRUE(seen(-day));  // simulated time
}

/// Two cameras 0.3 m apart and the table before them, as a camera node tells it.
v1::CameraRig rig_message(double aims_higher_m = 0.0) {
  image::View left, right;
  right.eye_m[0] += 0.3;
  right.target_m[1] += aims_higher_m;
  image::Rig rig;
  rig.date = "2026-01-01";
  rig.board = "none";
  rig.frame = image::Rig::Frame::table;
  rig.pictures = 1;
  rig.cameras = {{"left", image::Camera(left)}, {"right", image::Camera(right)}};
  v1::CameraRig message;
  message.set_text(model::rig_text(rig));
  return message;
}

/// Paints what a camera sees of a cylinder in the plane of motion.
void paint_cylinder(const image::Camera& camera, double x, const std::array<int, 3>& bgr,
                    std::string& data) {
  const Eigen::Vector2d a = camera.project({x, 0.0, 0.0}), b = camera.project({x, 0.09, 0.0});
  const double half = 0.025 * camera.scale({x, 0.045, 0.0});
  for (int v = static_cast<int>(b.y()); v < static_cast<int>(a.y()); ++v) {
    const double share = (v - a.y()) / (b.y() - a.y()), u = a.x() + share * (b.x() - a.x());
    for (int k = static_cast<int>(u - half); k <= static_cast<int>(u + half); ++k) {
      const auto at = 3 * static_cast<std::size_t>(640 * v + k);
      for (std::size_t c = 0; c < 3; ++c) data[at + c] = static_cast<char>(bgr[c]);
    }
  }
}

/// What each of them sees of a green cylinder, and of two violet ones if there are.
foxglove::RawImage picture_of_cylinder(int side, bool violet = false) {
  image::View view;
  view.eye_m[0] += 0.3 * side;
  foxglove::RawImage m = picture("bgr8");
  std::string data(3 * 640 * 480, '\x96');
  paint_cylinder(image::Camera(view), -0.1, {80, 200, 70}, data);
  for (const double x : violet ? std::vector{0.1, 0.25} : std::vector<double>{})
    paint_cylinder(image::Camera(view), x, {196, 62, 158}, data);
  m.set_data(data);
  return m;
}

TEST(VisionStereo, MeasuresThingsFromPairsOfOneTimeOnly) {
  testing::Loopback bus;
  VisionParams p = params();
  p.table.origin_m = {1.0, 2.0, 3.0};
  p.table.yaw_rad = std::numbers::pi;
  VisionNode node(p, bus);
  bus.send("rig", rig_message(), 0s);
  std::optional<v1::TeacherScene> scene;
  runtime::Time now = 1s;
  const auto show = [&](runtime::Time late) {
    now += 33ms;
    bus.send("image", picture_of_cylinder(0), now);
    bus.send("right", picture_of_cylinder(1), now + late);
    node.step(now + 1ms);
    return bus.take_last<v1::TeacherScene>("scene");
  };
  for (int i = 0; i < 8; ++i) scene = show(1ms);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->things_size(), 1);
  const v1::TableThing& thing = scene->things(0);
  EXPECT_EQ(thing.kind(), v1::BLOB_KIND_OBJECT);
  EXPECT_NEAR(thing.center_in_table_m().x_m(), -0.1, 0.005);
  EXPECT_NEAR(thing.center_in_table_m().y_m(), 0.045, 0.005);
  EXPECT_NEAR(thing.center_in_table_m().z_m(), 0.0, 0.01);
  ASSERT_EQ(thing.spread_m_size(), 6);
  EXPECT_GT(thing.spread_m(5), 0.0);
  // Drawn in W: x, y, z of T are its y, z, x, here turned by half a turn.
  const auto seen = bus.take_last<foxglove::SceneUpdate>("seen");
  ASSERT_TRUE(seen);
  ASSERT_EQ(seen->entities(0).cylinders_size(), 1);
  const auto& drawn = seen->entities(0).cylinders(0);
  EXPECT_NEAR(drawn.pose().position().x(), 1.0, 0.01);
  EXPECT_NEAR(drawn.pose().position().y(), 2.1, 0.005);
  EXPECT_NEAR(drawn.pose().position().z(), 3.045, 0.005);
  const double* spread = thing.spread_m().data();  // its largest deviation is at least each row's
  EXPECT_GE(seen->entities(0).spheres(0).size().z() + 1e-12, 6.0 * std::abs(spread[5]));
  EXPECT_FALSE(show(10ms));  // it may still come
  node.step(now + 100ms);    // it did not
  EXPECT_TRUE(bus.take_last<v1::TeacherScene>("scene"));
}

TEST(VisionStereo, AnUnreadableRigLeavesTheOneBefore) {
  testing::Loopback bus;
  VisionNode node(params(), bus);
  v1::CameraRig bad = rig_message();
  bad.set_text(bad.text() + "extra: 1\n");
  bus.send("rig", bad, 0s);
  bus.send("image", picture("bgr8"), 1s);
  node.step(1s);
  EXPECT_TRUE(bus.take<v1::Blobs>("blobs"));  // by `view`, with one camera
}

TEST(VisionNode, LearnsColoursFromClicks) {
  testing::Loopback bus;
  VisionNode node(params(), bus);
  v1::ColorLesson lesson;
  v1::ColorRegion& region = *lesson.add_regions();  // the green thing is a bar from now on
  region.set_kind(v1::BLOB_KIND_BAR);
  region.set_left(110);
  region.set_top(220);
  region.set_width(9);
  region.set_height(9);
  lesson.mutable_header()->set_stamp_ns(2'000'000'000u);
  bus.send("lesson", lesson, 2s);
  for (const auto& [stamp, kind] : {std::pair{1s, v1::BLOB_KIND_OBJECT}, {2s, v1::BLOB_KIND_BAR}}) {
    bus.send("image", picture("bgr8"), stamp);
    node.step(stamp);
    const auto blobs = bus.take<v1::Blobs>("blobs");
    ASSERT_TRUE(blobs);
    ASSERT_EQ(blobs->blobs_size(), 1);
    EXPECT_EQ(blobs->blobs(0).kind(), kind);
  }
}

/// An unusable picture gives one line and no symbols.
class BadInput : public ::testing::Test {
 protected:
  BadInput() : node_(params(), bus_) { runtime::take_log_lines(); }
  /// A picture with the noise of a camera, which `count` hands are in.
  foxglove::RawImage noisy(int hands = 1) {
    foxglove::RawImage m = picture("bgr8");
    std::string& data = *m.mutable_data();
    for (std::size_t left = 200; hands > 0; --hands, left += 200) {
      for (std::size_t v = 50; v < 90; ++v) {
        for (std::size_t u = left; u < left + 60; ++u) {
          const std::array<int, 3> skin{116, 152, 220};
          for (std::size_t c = 0; c < 3; ++c)
            data[3 * (640 * v + u) + c] = static_cast<char>(skin[c]);
        }
      }
    }
    for (char& byte : data) byte = static_cast<char>(byte + static_cast<char>(random_() % 5) - 2);
    return m;
  }
  bool told(const foxglove::RawImage& image, runtime::Time later = 33ms) {
    stamp_ += later;
    bus_.send("image", image, stamp_);
    node_.step(stamp_);
    return bus_.take_last<v1::Observation>("observation").has_value();
  }
  bool told(const foxglove::RawImage& left, const foxglove::RawImage& right) {
    bus_.send("right", right, stamp_ + 33ms);
    return told(left);
  }
  void good(int pictures) {
    for (int i = 0; i < pictures; ++i) EXPECT_TRUE(told(noisy())) << i;
  }
  /// One line says so.
  static void expect_line(const std::string& text) {
    int count = 0;
    for (const runtime::LogLine& line : runtime::take_log_lines()) {
      if (line.text.find(text) == std::string::npos) continue;
      ++count;
      EXPECT_EQ(line.text.find('\n'), std::string::npos);
    }
    EXPECT_EQ(count, 1) << text;
  }

  testing::Loopback bus_;
  VisionNode node_;
  std::mt19937 random_{5};
  runtime::Time stamp_ = 1s;
};

TEST_F(BadInput, Black) {
  good(2);
  foxglove::RawImage black = noisy();
  for (char& byte : *black.mutable_data()) byte = static_cast<char>(byte & 3);
  EXPECT_FALSE(told(black));
  expect_line("black (median ");
  good(1);
}

TEST_F(BadInput, Frozen) {
  good(2);
  const foxglove::RawImage still = noisy();
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(told(still, 320ms)) << i;
  EXPECT_FALSE(told(still, 320ms));
  expect_line("the same for 3.2 s, to the last bit: the camera hangs");
  good(1);
}

TEST_F(BadInput, TornWithEmptyRows) {
  good(2);
  foxglove::RawImage torn = noisy();
  std::fill(torn.mutable_data()->end() - 40 * 1920, torn.mutable_data()->end(), '\0');
  EXPECT_FALSE(told(torn));
  expect_line("torn: the last 40 of 480 rows are empty");
  good(1);
}

/// The driver's buffer holds rows of an older picture: of the one before, or of one some buffers
/// ago.
TEST_F(BadInput, TornWithRowsOfAnEarlierPicture) {
  std::vector<foxglove::RawImage> shown;
  for (int i = 0; i < 12; ++i) {
    shown.push_back(noisy());
    EXPECT_TRUE(told(shown.back()));
  }
  for (const std::size_t back : {1, 4}) {
    foxglove::RawImage torn = noisy();
    const std::string& old = shown[shown.size() - back].data();
    std::copy(old.begin() + 1920 * 240, old.end(), torn.mutable_data()->begin() + 1920 * 240);
    EXPECT_FALSE(told(torn)) << back;
    good(1);
  }
  foxglove::RawImage torn = noisy();
  std::copy_n(shown.back().data().begin(), 1920 * 50, torn.mutable_data()->begin());
  EXPECT_FALSE(told(torn));
  expect_line("torn: of 480 rows those from 240 to 480 are of an earlier image");
  good(3);
}

/// Pictures without noise, and films, keep rows where nothing moves.
TEST_F(BadInput, RowsThatStayAreNotTorn) {
  for (int i = 0; i < 20; ++i) {
    foxglove::RawImage image = noisy();
    if (i % 5 != 0) image = picture("bgr8");
    for (std::size_t u = 0; u < 1920; ++u) (*image.mutable_data())[1920 * (300 + i) + u] = '\x20';
    EXPECT_TRUE(told(image)) << i;
  }
}

TEST_F(BadInput, OfAnotherSize) {
  good(1);
  foxglove::RawImage small = noisy();
  small.set_width(320);
  EXPECT_FALSE(told(small));
  expect_line("320x480 does not fit the calibrated view of 640x480");
  good(1);
}

TEST_F(BadInput, TwoHands) {
  good(1);
  for (int i = 0; i < 9; ++i) EXPECT_TRUE(told(noisy(2)));  // an arm that is cut in two for moments
  EXPECT_FALSE(told(noisy(2)));
  expect_line("two hands are seen, expected one: symbols withheld");
  good(1);
}

TEST_F(BadInput, NoHand) {
  for (int i = 0; i < 400; ++i) {
    ASSERT_TRUE(told(noisy(0)));
  }
  expect_line("no hand is seen: no symbols are told");
  good(1);
}

TEST_F(BadInput, SwappedCameras) {
  bus_.send("rig", rig_message(), 0s);
  for (int i = 0; i < 29; ++i) told(picture_of_cylinder(1, true), picture_of_cylinder(0, true));
  EXPECT_FALSE(told(picture_of_cylinder(1, true), picture_of_cylinder(0, true)));
  expect_line("2 classes of things are in both pictures, but not in one place by input rig");
}

TEST_F(BadInput, TheCalibrationOfAnotherPair) {
  bus_.send("rig", rig_message(0.04), 0s);
  for (int i = 0; i < 29; ++i) told(picture_of_cylinder(0, true), picture_of_cylinder(1, true));
  EXPECT_FALSE(told(picture_of_cylinder(0, true), picture_of_cylinder(1, true)));
  expect_line("or the calibration that of others?");
}

/// Turned by 0.2 degrees after its calibration: things still find each other.
TEST_F(BadInput, TheCalibrationOfANearlyEqualPair) {
  bus_.send("rig", rig_message(0.0035), 0s);
  int symbols = 0;
  for (int i = 0; i < 60; ++i)
    symbols += told(picture_of_cylinder(0, true), picture_of_cylinder(1, true)) ? 1 : 0;
  EXPECT_LT(symbols, 45);
  EXPECT_FALSE(told(picture_of_cylinder(0, true), picture_of_cylinder(1, true)));
  expect_line("rows of the same things differ by ");
}

TEST_F(BadInput, ASecondCameraThatHangs) {
  bus_.send("rig", rig_message(), 0s);
  const foxglove::RawImage still = picture_of_cylinder(1, true);
  for (int i = 0; i < 20; ++i) {
    stamp_ += 300ms;
    told(picture_of_cylinder(0, i % 2 == 0), still);
  }
  EXPECT_FALSE(told(picture_of_cylinder(0), still));
  expect_line("to the last bit: the camera hangs");
}

}  // namespace
}  // namespace mimesis::vision
