#include "nodes/vision/teach.h"

#include <gtest/gtest.h>

#include <random>

#include "nodes/vision/table_watcher.h"

namespace mimesis::vision {
namespace {

/// Patches of random colours on a grey table, with noise; patch k is at 20 + 100 k.
struct Scene {
  image::Image image{640, 240};
  std::array<std::array<double, 3>, 4> colors{};
};

Scene scene(unsigned seed, double noise, double gain) {
  std::mt19937 random(seed);
  std::normal_distribution<double> grain(0.0, noise);
  Scene out;
  // Chromas a quarter of a turn apart, at an angle that nobody knows.
  const double turn = std::uniform_real_distribution<double>(0.0, 1.5)(random);
  for (std::size_t k = 0; k < 4; ++k) {
    const double angle = turn + 1.5708 * static_cast<double>(k);
    const double u = 45.0 * std::cos(angle), v = 45.0 * std::sin(angle), y = 120.0;
    const double blue = y + u / 0.492, red = y + v / 0.877;
    out.colors[k] = {blue, (y - 0.299 * red - 0.114 * blue) / 0.587, red};
  }
  for (int row = 0; row < 240; ++row) {
    for (int column = 0; column < 640; ++column) {
      const int patch =
          row >= 60 && row < 160 && column % 100 >= 20 && column < 400 ? column / 100 : -1;
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = patch < 0 ? 150.0 : out.colors[static_cast<std::size_t>(patch)][c];
        out.image.at(column, row)[c] =
            static_cast<std::uint8_t>(std::clamp(gain * value + grain(random) + 0.5, 0.0, 255.0));
      }
    }
  }
  return out;
}

const std::vector<TaughtRegion> kRegions{{Kind::hand, 30, 70, 50, 60},
                                         {Kind::object, 130, 70, 30, 30},
                                         {Kind::bar, 240, 80, 11, 11},
                                         {Kind::goal_low, 330, 70, 40, 80}};

/// Share of wrong labels in the patches and outside of them, their edges left out.
std::pair<double, double> mistakes(const ColorTable& table, const image::Image& image) {
  constexpr std::array<Kind, 4> kinds{Kind::hand, Kind::object, Kind::bar, Kind::goal_low};
  double missed = 0.0, inside = 0.0, wrong = 0.0, outside = 0.0;
  for (int row = 0; row < 240; ++row) {
    for (int column = 0; column < 640; ++column) {
      const std::uint8_t* p = image.at(column, row);
      const Kind label = table.label(p[0], p[1], p[2]);
      if (row >= 62 && row < 158 && column % 100 >= 22 && column % 100 < 98 && column < 400) {
        ++inside;
        missed += label != kinds.at(static_cast<std::size_t>(column / 100)) ? 1.0 : 0.0;
      } else if (row < 58 || row > 162) {
        ++outside;
        wrong += label != Kind::none ? 1.0 : 0.0;
      }
    }
  }
  return {missed / inside, wrong / outside};
}

TEST(Teach, FindsTheTaughtColoursInOtherPicturesAndLight) {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    const auto lesson = teach(scene(seed, 6.0, 1.0).image, kRegions);
    ASSERT_TRUE(lesson) << lesson.error().reason;
    EXPECT_TRUE(lesson->warnings.empty()) << lesson->warnings.front();
    ColorTable table(lesson->spots);
    const auto [missed, wrong] = mistakes(table, scene(seed, 6.0, 1.0).image);
    EXPECT_LT(missed, 0.03) << seed;
    EXPECT_LT(wrong, 1e-4) << seed;
    // The light meter brings the picture back to the light of the lesson.
    const image::Image dim = scene(seed, 4.0, 0.65).image;
    LightMeter meter(lesson->spots, lesson->reference_bgr);
    table.set_gain(meter.update(dim));
    const auto [missed_dim, wrong_dim] = mistakes(table, dim);
    EXPECT_LT(missed_dim, 0.05) << seed;
    EXPECT_LT(wrong_dim, 1e-3) << seed;
  }
}

TEST(Teach, AStrangerInTheRegionDoesNotWidenTheClass) {
  Scene s = scene(5, 3.0, 1.0);
  const auto clean = teach(s.image, kRegions);
  for (int v = 70; v < 76; ++v) {  // a tenth of the hand's region shows the bar's colour
    for (int u = 30; u < 80; ++u) {
      for (std::size_t c = 0; c < 3; ++c)
        s.image.at(u, v)[c] = static_cast<std::uint8_t>(s.colors[2][c]);
    }
  }
  const auto dirty = teach(s.image, kRegions);
  ASSERT_TRUE(clean && dirty);
  EXPECT_LT((dirty->spots.of[1]->mean - clean->spots.of[1]->mean).norm(), 1.0);
  EXPECT_LT((dirty->spots.of[1]->covariance - clean->spots.of[1]->covariance).norm(), 8.0);
}

TEST(Teach, ARegionOfLightAndShadeTeachesTheSameColourAsOneInLight) {
  Scene s = scene(8, 2.0, 1.0);
  const auto lit = teach(s.image, kRegions);
  for (int v = 70; v < 108; ++v) {  // most of the hand's region lies in shade
    for (int u = 30; u < 80; ++u) {
      for (std::size_t c = 0; c < 3; ++c) s.image.at(u, v)[c] = s.image.at(u, v)[c] / 2;
    }
  }
  const auto mixed = teach(s.image, kRegions);
  ASSERT_TRUE(lit && mixed);
  const auto ratio = [](const Lesson& lesson) -> Eigen::Vector2d {
    const ColorSpot& spot = *lesson.spots.of[1];
    return (spot.mean.array() - 128.0).matrix() / spot.y;
  };
  EXPECT_LT((ratio(*mixed) - ratio(*lit)).norm(), 0.05 * ratio(*lit).norm());
}

/// Taught from a picture without noise, so that the class is as narrow as it may be.
TEST(Teach, KnowsTheTaughtColourOverexposedAndInALampOfAnotherColour) {
  constexpr std::array<Kind, 4> kinds{Kind::hand, Kind::object, Kind::bar, Kind::goal_low};
  for (const unsigned seed : {9u, 10u, 11u}) {
    const Scene s = scene(seed, 2.0, 1.0);
    const ColorTable table(teach(s.image, kRegions)->spots);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      const Eigen::Vector3d color = Eigen::Vector3d::Map(s.colors.at(k).data());
      const auto label = [&table](const Eigen::Vector3d& bgr) {
        const Eigen::Array3i at = bgr.cwiseMin(255.0).cast<int>();
        return table.label(static_cast<std::uint8_t>(at[0]), static_cast<std::uint8_t>(at[1]),
                           static_cast<std::uint8_t>(at[2]));
      };
      // Its strongest channel would be at 285 of 255.
      EXPECT_EQ(label(285.0 / color.maxCoeff() * color), kinds.at(k)) << seed << k;
      for (const double warmth : {0.96, 1.04}) {
        const Eigen::Vector3d lamp(1.0 / warmth, 1.0, warmth);
        EXPECT_EQ(label(1.3 * lamp.cwiseProduct(color)), kinds.at(k)) << seed << k << warmth;
      }
    }
  }
}

/// The strongest channel of what is taught is at its end; the other camera sees it in less light.
TEST(Teach, KnowsInLessLightWhatWasTaughtOverexposed) {
  constexpr std::array<Kind, 4> kinds{Kind::hand, Kind::object, Kind::bar, Kind::goal_low};
  for (unsigned seed = 12; seed < 18; ++seed) {
    const Scene s = scene(seed, 2.0, 1.0);
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      const double gain = 292.0 / std::ranges::max(s.colors.at(k));
      const ColorTable table(teach(scene(seed, 2.0, gain).image, kRegions)->spots);
      std::array<std::uint8_t, 3> dim{};
      for (std::size_t c = 0; c < 3; ++c)
        dim.at(c) = static_cast<std::uint8_t>(0.75 * gain * s.colors.at(k).at(c));
      EXPECT_EQ(table.label(dim[0], dim[1], dim[2]), kinds.at(k)) << seed << k;
    }
  }
}

TEST(Teach, WarnsOfClassesThatLookAlike) {
  const Scene s = scene(6, 3.0, 1.0);
  std::vector<TaughtRegion> regions = kRegions;
  regions.push_back({Kind::goal_high, 160, 110, 30, 40});  // the object's patch
  const auto lesson = teach(s.image, regions);
  ASSERT_TRUE(lesson);
  ASSERT_EQ(lesson->warnings.size(), 1u);
  EXPECT_NE(lesson->warnings[0].find("object and goal_high"), std::string::npos);
  regions.back() = {Kind::goal_high, 500, 20, 40, 40};  // the table
  const auto grey = teach(s.image, regions);
  ASSERT_TRUE(grey);
  EXPECT_NE(grey->warnings.at(0).find("goal_high has the chroma of the table"), std::string::npos);
}

TEST(Teach, RefusesRegionsThatAreNotThere) {
  const Scene s = scene(7, 3.0, 1.0);
  for (const TaughtRegion& region :
       {TaughtRegion{Kind::hand, 600, 10, 50, 10}, TaughtRegion{Kind::hand, -1, 10, 20, 20},
        TaughtRegion{Kind::hand, 10, 10, 0, 20}, TaughtRegion{Kind::hand, 10, 230, 20, 2000000000},
        TaughtRegion{Kind::hand, 10, 10, 2, 4}}) {
    const auto lesson = teach(s.image, std::span(&region, 1));
    ASSERT_FALSE(lesson);
    EXPECT_NE(lesson.error().reason.find("hand: "), std::string::npos);
  }
}

/// A grey table with a green thing and, where asked, patches of the colour of skin: one that lies
/// there and a hand.
image::Image table_with(bool lying, bool hand) {
  image::Image image(640, 480);
  const auto fill = [&image](int left, int top, int width, int height, std::array<int, 3> bgr) {
    for (int v = top; v < top + height; ++v) {
      for (int u = left; u < left + width; ++u) {
        for (std::size_t c = 0; c < 3; ++c)
          image.at(u, v)[c] = static_cast<std::uint8_t>(bgr.at(c));
      }
    }
  };
  fill(0, 0, 640, 480, {145, 151, 155});
  fill(300, 200, 40, 70, {90, 200, 90});
  if (lying) fill(20, 380, 150, 60, {116, 152, 220});
  if (hand) fill(100, 200, 90, 60, {116, 152, 220});
  return image;
}

TEST(Teach, WhatHasTheColourOfSkinOnATableWithoutAHandIsNone) {
  TableWatcher watcher{WatcherSetup{}};
  ASSERT_TRUE(watcher.teach(table_with(true, false),
                            std::array{TaughtRegion{Kind::object, 305, 205, 30, 60}}));
  watcher.watch(table_with(true, false));
  EXPECT_FALSE(watcher.blob(Kind::hand).found());
  watcher.watch(table_with(true, true));
  EXPECT_FALSE(watcher.two_hands());
  EXPECT_NEAR(watcher.blob(Kind::hand).moments.mean_v(), 229.5, 1.0);
  watcher.watch(table_with(false, true));  // it was taken away: what comes there may be a hand
  for (int k = 0; k < 9; ++k) watcher.watch(table_with(true, true));
  EXPECT_FALSE(watcher.two_hands());  // it may be a part of the same arm
  watcher.watch(table_with(true, true));
  EXPECT_TRUE(watcher.two_hands());
}

TEST(Teach, NothingIsUnderTheTable) {
  TableWatcher watcher{WatcherSetup{}};
  const image::Image taught = table_with(false, false);
  ASSERT_TRUE(watcher.teach(taught, std::array{TaughtRegion{Kind::object, 305, 205, 30, 60}}));
  for (int k = 0; k < 20; ++k) watcher.watch(taught);
  EXPECT_TRUE(watcher.sight().object);
  image::Image below = taught;
  for (int v = 200; v < 270; ++v) {
    for (int u = 300; u < 340; ++u)
      std::swap_ranges(below.at(u, v), below.at(u, v) + 3, below.at(u, v + 200));
  }
  for (int k = 0; k < 40; ++k) watcher.watch(below);  // until it may be anywhere
  EXPECT_TRUE(watcher.blob(Kind::object).found());
  EXPECT_FALSE(watcher.sight().object);
}

TEST(Teach, AHandThatIsTaughtIsInThePicture) {
  TableWatcher watcher{WatcherSetup{}};
  ASSERT_TRUE(watcher.teach(table_with(false, true),
                            std::array{TaughtRegion{Kind::hand, 105, 205, 80, 50}}));
  watcher.watch(table_with(false, true));
  EXPECT_TRUE(watcher.blob(Kind::hand).found());
}

}  // namespace
}  // namespace mimesis::vision
