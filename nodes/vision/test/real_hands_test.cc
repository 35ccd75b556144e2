// Real hands that were shown once: segmentation against labels of our own.
#include <gtest/gtest.h>

#include <cstdio>

#include "common/image/image.h"
#include "common/shared_data.h"
#include "nodes/vision/blob_tracker.h"
#include "nodes/vision/teach.h"

namespace mimesis::vision {
namespace {

/// A picture of a person that teaches his skin, by a region of the hand, and others that are
/// judged.
struct Person {
  const char* lesson;
  TaughtRegion region;
  std::vector<const char*> judged;
};
const std::vector<Person> kPersons{
    {"0_IMG_1118", {Kind::hand, 52, 46, 14, 14}, {"1_IMG_1119", "3_IMG_1121"}},
    {"0_IMG_1322", {Kind::hand, 38, 60, 20, 30}, {"1_IMG_1323", "3_IMG_1325"}},
    {"0_IMG_4233", {Kind::hand, 37, 58, 20, 28}, {"2_IMG_4235"}},
    {"3_IMG_4439", {Kind::hand, 44, 60, 26, 30}, {"8_IMG_4444"}},
    {"0_IMG_4446", {Kind::hand, 22, 56, 24, 34}, {"1_IMG_4447"}},
    {"3_IMG_4677", {Kind::hand, 46, 54, 22, 36}, {"4_IMG_4678"}},
    {"0_IMG_4684", {Kind::hand, 32, 55, 26, 30}, {"1_IMG_4685"}},
    {"4_IMG_4880", {Kind::hand, 36, 70, 28, 26}, {"6_IMG_4882"}},
    {"0_IMG_4896", {Kind::hand, 32, 55, 20, 38}, {"1_IMG_4897"}},
    {"4_IMG_5095", {Kind::hand, 36, 60, 26, 30}, {"6_IMG_5097"}},
    {"1_IMG_5102", {Kind::hand, 32, 56, 28, 28}, {"3_IMG_5104"}},
    {"0_IMG_5111", {Kind::hand, 28, 52, 24, 22}, {"2_IMG_5113"}},
    {"4_IMG_5301", {Kind::hand, 42, 58, 26, 34}, {"6_IMG_5303"}},
    {"1_IMG_5309", {Kind::hand, 26, 56, 24, 36}, {"3_IMG_5311"}},
    {"4_IMG_5521", {Kind::hand, 36, 54, 24, 34}, {"6_IMG_5523"}},
    {"1_IMG_5528", {Kind::hand, 36, 60, 26, 30}, {"3_IMG_5530"}},
    {"4_IMG_5730", {Kind::hand, 32, 58, 24, 36}, {"6_IMG_5732"}},
    {"1_IMG_5737", {Kind::hand, 32, 70, 28, 26}, {"3_IMG_5739"}}};

constexpr int kPortrait = 100, kPortraitColumns = 5;

/// The n-th label: white where the hand is, nails included, sleeves, bracelets and shadows not.
/// Made by GrabCut of OpenCV (another method: colours and edges of the picture itself) in pictures
/// enlarged four times, begun from red beyond blue; black rims of the flash's shadow taken off, a
/// sleeve (6_IMG_5097) by strokes; then each looked at, enlarged, against its picture.
bool labelled(const image::Image& sheet, int n, int u, int v) {
  return sheet.at(n % kPortraitColumns * kPortrait + u, n / kPortraitColumns * kPortrait + v)[0] >
         127;
}

TEST(RealHands, AreSegmentedAfterOneLessonPerPerson) {
  const auto folder = shared_data("data/vision/sign_digits");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "not here: " << folder << " is absent";
  const auto sheet = image::read_image(MIMESIS_SOURCE_DIR "/nodes/vision/test/hands/labels.png");
  ASSERT_TRUE(sheet) << sheet.error().reason;
  double sum = 0.0, least = 1.0;
  int n = 0;
  for (const Person& person : kPersons) {
    const auto shown = image::read_image(folder / (std::string(person.lesson) + ".JPG"));
    ASSERT_TRUE(shown) << shown.error().reason;
    const auto lesson = teach(*shown, std::span(&person.region, 1));
    ASSERT_TRUE(lesson) << lesson.error().reason;
    for (const char* name : person.judged) {
      const auto picture = image::read_image(folder / (std::string(name) + ".JPG"));
      ASSERT_TRUE(picture) << picture.error().reason;
      Segmentation segmentation(ColorTable(lesson->spots),
                                LightMeter(lesson->spots, lesson->reference_bgr), false);
      segmentation.segment(*picture);
      BlobTracker tracker(TrackerLimits{});
      tracker.update(segmentation.regions());
      const Blob& hand = tracker.blob(Kind::hand);
      std::vector<bool> seen(kPortrait * kPortrait);
      for (const vision::Run& run : segmentation.runs()) {
        if (!std::ranges::binary_search(hand.regions, run.region)) continue;
        std::fill(seen.begin() + kPortrait * run.row + run.begin,
                  seen.begin() + kPortrait * run.row + run.end, true);
      }
      int both = 0, either = 0;
      for (int i = 0; i < kPortrait * kPortrait; ++i) {
        const bool label = labelled(*sheet, n, i % kPortrait, i / kPortrait),
                   ours = seen[static_cast<std::size_t>(i)];
        both += label && ours ? 1 : 0;
        either += label || ours ? 1 : 0;
      }
      const double overlap = static_cast<double>(both) / either;
      std::printf("%s: %.3f\n", name, overlap);
      sum += overlap;
      least = std::min(least, overlap);
      ++n;
    }
  }
  EXPECT_EQ(n, 20);
  std::printf("intersection over union: mean %.3f, least %.3f\n", sum / n, least);
  EXPECT_GE(sum / n, 0.9);
}

/// The labelled hand of a portrait before a room of another colour: what is found of it, as a
/// share.
double found_before(const image::Image& room, const image::Image& portrait,
                    const image::Image& sheet, int n, const Lesson& lesson) {
  constexpr int kLeft = 270, kTop = 190;
  image::Image shown = room;
  for (int v = 0; v < kPortrait; ++v) {
    for (int u = 0; u < kPortrait; ++u) {
      if (labelled(sheet, n, u, v))
        std::copy_n(portrait.at(u, v), 3, shown.at(kLeft + u, kTop + v));
    }
  }
  Segmentation segmentation(ColorTable(lesson.spots),
                            LightMeter(lesson.spots, lesson.reference_bgr), false);
  segmentation.segment(shown);
  int hand = 0, found = 0;
  for (int v = 0; v < kPortrait; ++v) {
    for (int u = 0; u < kPortrait; ++u) {
      if (!labelled(sheet, n, u, v)) continue;
      ++hand;
      const auto at = static_cast<std::size_t>((kTop + v) * shown.width + kLeft + u);
      found += segmentation.labels()[at] == static_cast<std::uint8_t>(Kind::hand) ? 1 : 0;
    }
  }
  return static_cast<double>(found) / hand;
}

/// The same hands, cut out and put before a dim grey room, as photographed and tinted green or
/// violet.
TEST(RealHands, AreKnownBeforeAnotherBackground) {
  const auto folder = shared_data("data/vision/sign_digits"),
             rooms = shared_data("vision/stereo_calibration");
  if (!std::filesystem::exists(folder) || !std::filesystem::exists(rooms))
    GTEST_SKIP() << "not here: " << folder << " or " << rooms << " is absent";
  const auto sheet = image::read_image(MIMESIS_SOURCE_DIR "/nodes/vision/test/hands/labels.png");
  const auto room = image::read_image(rooms / "left01.jpg");
  ASSERT_TRUE(sheet && room);
  for (const Eigen::Vector3d& paint :
       {Eigen::Vector3d(1.0, 1.0, 1.0), Eigen::Vector3d(0.5, 1.0, 0.5),
        Eigen::Vector3d(1.0, 0.4, 0.9)}) {
    image::Image painted = *room;
    for (std::size_t i = 0; i < painted.bgr.size(); ++i)
      painted.bgr[i] =
          static_cast<std::uint8_t>(paint[static_cast<Eigen::Index>(i % 3)] * painted.bgr[i]);
    double sum = 0.0;
    int n = 0;
    for (const Person& person : kPersons) {
      const auto shown = image::read_image(folder / (std::string(person.lesson) + ".JPG"));
      ASSERT_TRUE(shown) << shown.error().reason;
      const auto lesson = teach(*shown, std::span(&person.region, 1));
      ASSERT_TRUE(lesson) << lesson.error().reason;
      for (const char* name : person.judged) {
        const auto portrait = image::read_image(folder / (std::string(name) + ".JPG"));
        ASSERT_TRUE(portrait) << portrait.error().reason;
        sum += found_before(painted, *portrait, *sheet, n++, *lesson);
      }
    }
    std::printf("room x (%.1f, %.1f, %.1f): %.3f of the hands\n", paint[0], paint[1], paint[2],
                sum / n);
    EXPECT_GE(sum / n, 0.9);
  }
}

}  // namespace
}  // namespace mimesis::vision
