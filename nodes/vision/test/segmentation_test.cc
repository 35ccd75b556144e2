#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <random>

#include "common/testing/no_malloc.h"
#include "nodes/vision/regions.h"

namespace mimesis::vision {
namespace {

image::Image random_image(int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  image::Image out(width, height);
  for (auto& byte : out.bgr) byte = static_cast<std::uint8_t>(random());
  return out;
}

/// Patches of all classes and none, with ragged edges and holes.
std::vector<std::uint8_t> random_labels(int width, int height, unsigned seed, int coarse) {
  std::mt19937 random(seed);
  std::vector<std::uint8_t> labels(static_cast<std::size_t>(width * height));
  const int columns = width / coarse + 1;
  std::vector<std::uint8_t> patches(static_cast<std::size_t>(columns * (height / coarse + 1)));
  for (auto& p : patches) p = static_cast<std::uint8_t>(random() % (kKinds + 3) % kKinds);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const bool speck = random() % 11 == 0;
      labels[static_cast<std::size_t>(v * width + u)] =
          speck ? static_cast<std::uint8_t>(random() % kKinds)
                : patches[static_cast<std::size_t>(v / coarse * columns + u / coarse)];
    }
  }
  return labels;
}

TEST(ColorTable, GivesEveryPixelTheClassOfTheScalarReference) {
  const ColorBoxes boxes;
  ColorTable table(boxes);
  const Eigen::Vector3d gain(1.13, 0.97, 0.88);
  table.set_gain(gain);
  const image::Image image = random_image(320, 240, 7);
  std::vector<std::uint8_t> labels;
  table.apply(image, labels);
  ASSERT_EQ(labels.size(), 320u * 240u);
  std::array<int, kKinds> count{};
  for (std::size_t i = 0; i < labels.size(); ++i) {
    const auto middle = [&](std::size_t c) {
      return gain[static_cast<Eigen::Index>(c)] * (image.bgr[3 * i + c] / 8 * 8 + 4);
    };
    const double b = middle(0), g = middle(1), r = middle(2);
    const double y = 0.299 * r + 0.587 * g + 0.114 * b;
    const double u = 128 + 0.492 * (b - y), v = 128 + 0.877 * (r - y);
    int expected = 0;
    for (int k = static_cast<int>(kKinds) - 1; k > 0; --k) {
      const ColorBox& box = boxes.of(static_cast<Kind>(k));
      if (u >= box.u_min && u <= box.u_max && v >= box.v_min && v <= box.v_max && y >= box.y_min &&
          y <= box.y_max) {
        expected = k;  // downwards: the first class wins
      }
    }
    ASSERT_EQ(labels[i], expected) << "pixel " << i;
    ++count[labels[i]];
  }
  for (const int n : count) EXPECT_GT(n, 100);  // the picture tries every class
}

TEST(ColorTable, AgreesWithOpenCvsYuvUpToTheCellsWidth) {
  for (const auto& [b, g, r] : {std::array{124, 156, 214}, {200, 30, 90}, {12, 250, 130}}) {
    cv::Mat pixel(1, 1, CV_8UC3, cv::Scalar(b, g, r)), yuv;
    cv::cvtColor(pixel, yuv, cv::COLOR_BGR2YUV);
    const Yuv ours = to_yuv(b, g, r);
    EXPECT_NEAR(ours.y, yuv.at<cv::Vec3b>(0)[0], 1.0);
    EXPECT_NEAR(ours.u, yuv.at<cv::Vec3b>(0)[1], 1.0);
    EXPECT_NEAR(ours.v, yuv.at<cv::Vec3b>(0)[2], 1.0);
  }
}

TEST(RegionFinder, EqualsOpenCvsComponentsClassByClass) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const int width = 163 + static_cast<int>(seed), height = 97;
    const auto labels = random_labels(width, height, seed, 3 * static_cast<int>(seed));
    RegionFinder finder;
    finder.find(labels, width, height);
    std::size_t total = 0;
    for (std::size_t k = 1; k < kKinds; ++k) {
      cv::Mat mask(height, width, CV_8U);
      for (std::size_t i = 0; i < labels.size(); ++i) mask.data[i] = labels[i] == k ? 1 : 0;
      cv::Mat names, stats, centroids;
      const int n = cv::connectedComponentsWithStats(mask, names, stats, centroids, 8);
      total += static_cast<std::size_t>(n - 1);
      std::vector<char> matched(static_cast<std::size_t>(n), 0);
      for (const vision::Run& run : finder.runs()) {
        if (run.kind != static_cast<Kind>(k)) continue;
        const int name = names.at<int>(run.row, run.begin);
        const Moments& m = finder.regions()[static_cast<std::size_t>(run.region)].moments;
        matched[static_cast<std::size_t>(name)] = 1;
        ASSERT_EQ(m.area, stats.at<int>(name, cv::CC_STAT_AREA));
        ASSERT_EQ(m.left, stats.at<int>(name, cv::CC_STAT_LEFT));
        ASSERT_EQ(m.top, stats.at<int>(name, cv::CC_STAT_TOP));
        ASSERT_EQ(m.right - m.left + 1, stats.at<int>(name, cv::CC_STAT_WIDTH));
        ASSERT_EQ(m.bottom - m.top + 1, stats.at<int>(name, cv::CC_STAT_HEIGHT));
        ASSERT_NEAR(m.mean_u(), centroids.at<double>(name, 0), 1e-9);
        ASSERT_NEAR(m.mean_v(), centroids.at<double>(name, 1), 1e-9);
      }
      EXPECT_EQ(std::count(matched.begin() + 1, matched.end(), 1), n - 1);
    }
    EXPECT_EQ(finder.regions().size(), total);
    EXPECT_GT(total, 100u);
  }
}

TEST(RegionFinder, SecondMomentsGiveTheAxesOfAnEllipse) {
  constexpr int kSize = 400;
  cv::Mat picture(kSize, kSize, CV_8U, cv::Scalar(0));
  cv::ellipse(picture, {200, 190}, {120, 40}, 30.0, 0.0, 360.0, cv::Scalar(2), cv::FILLED);
  RegionFinder finder;
  finder.find({picture.data, kSize * kSize}, kSize, kSize);
  ASSERT_EQ(finder.regions().size(), 1u);
  const Axes shape = axes(finder.regions()[0].moments);
  EXPECT_NEAR(shape.angle_rad, 30.0 * CV_PI / 180.0, 0.01);
  EXPECT_NEAR(shape.elongation, 3.0, 0.05);
}

TEST(RegionFinder, DoesNotAllocateOnceItHasSeenSuchPictures) {
  const auto labels = random_labels(200, 150, 5, 9);
  RegionFinder finder;
  finder.find(labels, 200, 150);
  const std::size_t before = finder.regions().size();
  {
    testing::NoMalloc guard;
    finder.find(labels, 200, 150);
  }
  EXPECT_EQ(finder.regions().size(), before);
}

TEST(LightMeter, TurnsWarmDimLightIntoTheReference) {
  image::Image image(100, 80);
  const Eigen::Vector3d reference(140, 150, 160), light(0.5, 0.6, 0.8);
  for (std::size_t i = 0; i < image.bgr.size(); ++i) {
    const auto c = static_cast<Eigen::Index>(i % 3);
    image.bgr[i] = static_cast<std::uint8_t>(reference[c] * light[c]);
  }
  LightMeter meter(reference);
  EXPECT_TRUE(meter.update(image).isApprox(light.cwiseInverse(), 0.01));
  LightMeter off(Eigen::Vector3d::Zero());
  EXPECT_TRUE(off.update(image).isApprox(Eigen::Vector3d::Ones()));
}

}  // namespace
}  // namespace mimesis::vision
