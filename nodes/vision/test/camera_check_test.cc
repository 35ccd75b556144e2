#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <random>

#include "nodes/vision/teach.h"

namespace mimesis::vision {
namespace {

/// A desk of this grey with tilted dark squares, a blue and a green thing, seen with a blur and
/// with noise.
image::Image desk(double blur_px, double grey = 150.0, unsigned seed = 1) {
  image::Image out(640, 480);
  cv::Mat view(480, 640, CV_8UC3, out.bgr.data());
  view.setTo(cv::Scalar(grey, grey, grey));
  for (int k = 0; k < 6; ++k) {
    const std::vector<cv::Point> square{
        {60 + 90 * k, 60}, {120 + 90 * k, 70}, {110 + 90 * k, 130}, {50 + 90 * k, 120}};
    cv::fillConvexPoly(view, square, cv::Scalar::all(0.3 * grey), cv::LINE_AA);
  }
  cv::rectangle(view, {100, 200, 80, 60}, cv::Scalar(205, 96, 38), cv::FILLED);
  cv::rectangle(view, {300, 200, 80, 60}, cv::Scalar(90, 200, 90), cv::FILLED);
  if (blur_px > 0.0) cv::GaussianBlur(view, view, cv::Size(0, 0), blur_px);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 3.0);
  for (std::uint8_t& value : out.bgr)
    value = static_cast<std::uint8_t>(std::clamp(value + noise(random), 0.0, 255.0));
  return out;
}

bool advises(const std::vector<std::string>& advice, const std::string& about) {
  return std::ranges::any_of(
      advice, [&](const std::string& line) { return line.find(about) != std::string::npos; });
}

TEST(CameraCheck, MeasuresTheBlurOfEdges) {
  for (const double blur : {0.8, 1.2, 2.0, 3.0}) {
    const CameraReport report = check_camera({desk(blur)});
    ASSERT_TRUE(report.blur_px) << blur;
    if (blur < 2.5) {  // noise cuts softer ones
      EXPECT_NEAR(*report.blur_px, blur, 0.2 * blur + 0.1);
    }
    EXPECT_EQ(advises(report.advice, "focus"), blur > 1.5) << blur;
  }
}

TEST(CameraCheck, IsContentWithAGoodPicture) {
  EXPECT_TRUE(check_camera({desk(0.7), desk(0.7, 150.0, 2), desk(0.7, 150.0, 3)}).advice.empty());
}

TEST(CameraCheck, SaysThatThereIsTooMuchLightOrTooLittle) {
  EXPECT_TRUE(advises(check_camera({desk(0.7, 254.0)}).advice, "white end"));
  EXPECT_TRUE(advises(check_camera({desk(0.7, 30.0)}).advice, "more light"));
}

TEST(CameraCheck, TellsFlickerFromDriftAndMotion) {
  std::vector<image::Image> steady, drifting, flickering;
  for (unsigned i = 0; i < 8; ++i) {
    steady.push_back(desk(0.7, 150.0, i));
    drifting.push_back(desk(0.7, 150.0 + 3.0 * i, i));
    flickering.push_back(desk(0.7, i % 2 == 0 ? 145.0 : 155.0, i));
  }
  EXPECT_FALSE(advises(check_camera(steady).advice, "flicker"));
  EXPECT_FALSE(advises(check_camera(drifting).advice, "flicker"));
  EXPECT_TRUE(advises(check_camera(flickering).advice, "flicker"));
  EXPECT_NEAR(*check_camera(flickering).flicker, 10.0 / 150.0, 0.02);
  EXPECT_FALSE(check_camera({steady[0], steady[1]}).flicker);
}

TEST(CameraCheck, SaysWhichColoursAreMissedDoubledOrAlike) {
  const image::Image seen = desk(0.7);
  const auto lesson = teach(seen, std::vector<TaughtRegion>{{Kind::bar, 110, 210, 40, 40},
                                                            {Kind::object, 310, 210, 40, 40}});
  ASSERT_TRUE(lesson);
  const auto advice = [&](const image::Image& picture) {
    return check_colors(picture, lesson->spots, lesson->reference_bgr);
  };
  EXPECT_TRUE(advice(seen).empty());
  image::Image other = seen;
  cv::Mat view(480, 640, CV_8UC3, other.bgr.data());
  cv::rectangle(view, {500, 300, 60, 60}, cv::Scalar(205, 96, 38), cv::FILLED);
  EXPECT_TRUE(advises(advice(other), "bar at (1"));
  cv::rectangle(view, {290, 190, 100, 80}, cv::Scalar(150, 150, 150), cv::FILLED);
  EXPECT_TRUE(advises(advice(other), "object is not in view"));
  ColorSpots spots = lesson->spots;
  spots.of[static_cast<std::size_t>(Kind::goal_low)] = *spots.of[2];
  EXPECT_TRUE(advises(check_colors(seen, spots, lesson->reference_bgr), "taken for each other"));
}

}  // namespace
}  // namespace mimesis::vision
