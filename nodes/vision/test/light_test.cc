#include "nodes/vision/light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <random>

#include "common/shared_data.h"
#include "nodes/vision/teach.h"
#include "nodes/vision/testing/yuyv_of.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector3d;

const Vector3d kGrey(145.0, 151.0, 155.0);
const std::array<Vector3d, 3> kPaints{
    Vector3d{90.0, 200.0, 90.0}, {205.0, 96.0, 60.0}, {60.0, 190.0, 205.0}};
const std::vector<TaughtRegion> kClicks{{Kind::object, 45, 65, 30, 30},
                                        {Kind::bar, 145, 65, 30, 30},
                                        {Kind::goal_high, 245, 65, 30, 30}};

/// What lies behind the things.
enum class Behind { grey, wood, motley };

/// Three painted things before something, with noise, in light of this colour.
image::Image picture(Behind behind, const Vector3d& light = Vector3d::Ones(), int things = 3,
                     unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 3.0);
  image::Image out(320, 240);
  for (int v = 0; v < out.height; ++v) {
    for (int u = 0; u < out.width; ++u) {
      Vector3d color = kGrey;
      if (behind == Behind::wood) color = {80.0, 140.0, 190.0};
      if (behind == Behind::motley) {  // tiles of many colours, none of the things'
        const int tile = u / 40 + 3 * (v / 40);
        color = std::array<Vector3d, 4>{{{200, 190, 185},
                                         {70, 75, 80},
                                         {120, 110, 180},
                                         {150, 90, 140}}}[static_cast<std::size_t>(tile % 4)];
      }
      const int thing = u % 100 >= 40 && v >= 60 && v < 100 ? u / 100 : 3;
      if (thing < things) color = kPaints.at(static_cast<std::size_t>(thing));
      for (int c = 0; c < 3; ++c)
        out.at(u, v)[c] =
            static_cast<std::uint8_t>(std::clamp(light[c] * color[c] + noise(random), 0.0, 255.0));
    }
  }
  return out;
}

/// The meter after a lesson before something.
LightMeter taught(Behind behind) {
  const auto lesson = teach(picture(behind), kClicks);
  return {lesson->spots, lesson->reference_bgr};
}

/// Largest error of the gain's ratios of blue and red to green, as a share.
double white_error(const Vector3d& gain, const Vector3d& light) {
  const Vector3d both = gain.cwiseProduct(light);
  return std::max(std::abs(both[0] / both[1] - 1.0), std::abs(both[2] / both[1] - 1.0));
}

TEST(LightMeter, AStatedTableTurnsWarmDimLightIntoTheReference) {
  const Vector3d light(0.5, 0.6, 0.8);
  LightMeter meter(kGrey);
  EXPECT_TRUE(meter.update(picture(Behind::grey, light)).isApprox(light.cwiseInverse(), 0.02));
  LightMeter off(Vector3d::Zero());
  EXPECT_TRUE(off.update(picture(Behind::grey, light)).isApprox(Vector3d::Ones()));
}

TEST(LightMeter, AnotherViewIsNoOtherLight) {
  for (const Behind lesson : {Behind::grey, Behind::wood, Behind::motley}) {
    for (const Behind now : {Behind::grey, Behind::wood, Behind::motley}) {
      LightMeter meter = taught(lesson);
      const Vector3d gain = meter.update(picture(now, Vector3d::Ones(), 3, 2));
      EXPECT_LT(white_error(gain, Vector3d::Ones()), 0.03)
          << static_cast<int>(lesson) << static_cast<int>(now);
      EXPECT_EQ(meter.remark().find("what fills the picture") != std::string::npos,
                lesson != now && lesson != Behind::motley && now != Behind::motley)
          << meter.remark();
      EXPECT_NEAR(gain[1], 1.0, 0.1);
    }
  }
}

/// With a table and without one, from the first picture on and after the light has changed.
TEST(LightMeter, FollowsTheLightByWhatWasTaught) {
  for (const Behind behind : {Behind::grey, Behind::motley}) {
    for (const Vector3d& light :
         {Vector3d(0.8, 0.9, 1.05), Vector3d(1.1, 1.0, 0.9), Vector3d(0.6, 0.6, 0.6)}) {
      // One standard deviation is believed to be 10 %: a little of it is left without a table.
      const double left = behind == Behind::grey ? 0.03 : 0.06;
      LightMeter first = taught(behind), later = taught(behind);
      EXPECT_LT(white_error(first.update(picture(behind, light)), light), left)
          << light.transpose();
      later.update(picture(behind));
      for (unsigned k = 0; k < 40; ++k) later.update(picture(behind, light, 3, k));
      EXPECT_LT(white_error(later.update(picture(behind, light)), light), left)
          << light.transpose();
    }
  }
}

TEST(LightMeter, AJumpIsSaidAndFollowedInSteps) {
  const Vector3d light(1.0 / 1.3, 1.0, 1.3);
  LightMeter meter = taught(Behind::grey);
  meter.update(picture(Behind::grey));
  EXPECT_EQ(meter.remark(), "");
  Vector3d before = meter.update(picture(Behind::grey)), gain = before;
  int said = 0;
  for (unsigned k = 0; k < 40; ++k) {
    gain = meter.update(picture(Behind::grey, light, 3, k));
    EXPECT_LT((gain - before).cwiseAbs().maxCoeff(), 0.08);
    said += meter.remark().find("light: it jumped to") != std::string::npos ? 1 : 0;
    before = gain;
  }
  EXPECT_EQ(said, 1);
  EXPECT_LT(white_error(gain, light), 0.04);
}

TEST(LightMeter, WithNothingTaughtInSightThereIsNoCorrection) {
  LightMeter meter = taught(Behind::grey);
  for (const Behind now : {Behind::grey, Behind::wood, Behind::motley}) {
    const Vector3d gain = meter.update(picture(now, Vector3d(0.8, 1.0, 1.2), 0));
    EXPECT_TRUE(gain.isApprox(Vector3d::Ones())) << gain.transpose();
  }
}

TEST(LightMeter, ReadsYuyvAsItReadsBgr) {
  const Vector3d light(0.85, 0.9, 1.0);
  LightMeter meter = taught(Behind::motley), packed = taught(Behind::motley);
  const image::Image shown = picture(Behind::motley, light);
  EXPECT_TRUE(packed.update(yuyv_of(shown)).isApprox(meter.update(shown), 0.03));
}

/// A ball in a photograph: box around it, as shares of the picture.
struct Ball {
  double u = 0.0, v = 0.0, width = 0.0, height = 0.0;
};

/// The ball (class 0) among a picture's labels: lines of "class u v width height".
std::optional<Ball> ball_in(std::filesystem::path picture) {
  std::ifstream labels(picture.replace_extension(".txt"));
  int kind = 0;
  Ball ball;
  while (labels >> kind >> ball.u >> ball.v >> ball.width >> ball.height) {
    if (kind == 0) return ball;
  }
  return std::nullopt;
}

/// Pixels of the ball that are labelled as it, and those that there are.
std::pair<double, double> of_ball(const image::Image& image, const Ball& ball,
                                  const ColorTable& table) {
  double found = 0.0, all = 0.0;
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const double x = 2.0 * (u / static_cast<double>(image.width) - ball.u) / ball.width,
                   y = 2.0 * (v / static_cast<double>(image.height) - ball.v) / ball.height;
      if (x * x + y * y > 0.7) continue;
      const std::uint8_t* p = image.at(u, v);
      ++all;
      found += table.label(p[0], p[1], p[2]) == Kind::object ? 1.0 : 0.0;
    }
  }
  return {found, all};
}

/// Photographs of halls with labelled balls, a folder each: one click on the ball in the first.
/// What a hall's other views look like is no light: the meter must find what is found without a
/// correction, and the median of the picture as the table's colour must not do as well.
TEST(Photographs, OneClickKnowsTheBallInOtherViewsOfTheHall) {
  const auto halls = shared_data("data/vision/halls");
  if (!std::filesystem::exists(halls)) GTEST_SKIP() << "not here: " << halls << " is absent";
  std::array<double, 3> sum{};
  for (const auto& hall : std::filesystem::directory_iterator(halls)) {
    if (!hall.is_directory()) continue;
    std::vector<std::filesystem::path> files;
    for (const auto& file : std::filesystem::directory_iterator(hall)) {
      if (file.path().extension() == ".jpg" && ball_in(file.path())) files.push_back(file.path());
    }
    std::ranges::sort(files);
    ASSERT_GE(files.size(), 3u) << hall;
    const auto shown = image::read_image(files[0]);
    ASSERT_TRUE(shown) << shown.error().reason;
    const Ball clicked = *ball_in(files[0]);
    const auto at = [](double share, int size) {
      return std::clamp(static_cast<int>(share * size) - 5, 0, size - 11);
    };
    const TaughtRegion click{Kind::object, at(clicked.u, shown->width),
                             at(clicked.v, shown->height), 11, 11};
    const auto lesson = teach(*shown, std::span(&click, 1));
    ASSERT_TRUE(lesson) << lesson.error().reason;
    std::array<double, 4> found{};  // without correction, as it is, by the median; all
    for (const auto& file : std::span(files).subspan(1)) {
      const auto picture = image::read_image(file);
      ASSERT_TRUE(picture) << picture.error().reason;
      std::array<LightMeter, 3> meters{LightMeter(Vector3d::Zero()),
                                       LightMeter(lesson->spots, lesson->reference_bgr),
                                       LightMeter(median_bgr(*shown))};
      for (std::size_t k = 0; k < meters.size(); ++k) {
        ColorTable table(lesson->spots);
        table.set_gain(meters[k].update(*picture));
        const auto [here, all] = of_ball(*picture, *ball_in(file), table);
        found[k] += here;
        found[3] += k == 0 ? all : 0.0;
      }
    }
    std::printf(
        "%s: of %.0f pixels of the ball in %zu views %.0f, %.0f without correction, %.0f by "
        "the median\n",
        hall.path().filename().c_str(), found[3], files.size() - 1, found[1], found[0], found[2]);
    EXPECT_GE(found[1], 0.95 * found[0]) << hall;
    for (std::size_t k = 0; k < 3; ++k) sum[k] += found[k];
  }
  EXPECT_GT(sum[1], 1.2 * sum[2]);
}

}  // namespace
}  // namespace mimesis::vision
