#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>
#include <random>

#include "common/testing/no_malloc.h"
#include "nodes/vision/label_kernels.h"
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
  const Eigen::Vector3d gain(1.13, 0.97, 0.96);
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

TEST(LookUp, IsTheScalarReferenceForEveryLengthAndReadsNothingBeyond) {
  std::mt19937 random(12);
  std::vector<std::uint8_t> cells(65536), few(65536);
  for (auto& c : cells) c = static_cast<std::uint8_t>(random());
  for (std::size_t i = 0; i < few.size(); ++i) {  // most of the colours are of no class
    const std::size_t u = i & 63, v = i >> 6 & 63, y = i >> 12;
    if (u / 10 == 1 && v / 10 == 4) few[i] = 1;
    if (u / 4 == 7 && v > 5 && y > 3) few[i] = 2;
    if (u == 63 && v == 0) few[i] = 5;
  }
  for (const std::size_t pixels : {0, 2, 6, 8, 10, 12, 16, 18, 62, 64, 66, 100, 128, 642, 4098}) {
    // On the heap to the byte: the address sanitizer sees a read beyond.
    std::vector<std::uint8_t> bytes(3 * pixels), expected(pixels), labels(pixels, 0xee);
    for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
    look_up_bgr_scalar(bytes.data(), pixels, cells.data(), expected.data());
    look_up_bgr(bytes.data(), pixels, cells.data(), labels.data());
    EXPECT_EQ(labels, expected) << pixels;
    bytes.resize(2 * pixels);
    bytes.shrink_to_fit();
    for (const auto& table : {cells, few}) {
      look_up_yuyv_scalar(bytes.data(), pixels, table.data(), expected.data());
      look_up_yuyv(bytes.data(), pixels, YuyvCells(table), labels.data());
      EXPECT_EQ(labels, expected) << pixels;
    }
    for (const int k : {0, 30, 63}) {  // one pair of a class among others of none
      if (pixels < 66) continue;
      std::fill(bytes.begin(), bytes.end(), std::uint8_t{128});
      bytes[static_cast<std::size_t>(2 * k) / 4 * 4 + 1] = 255;
      bytes[static_cast<std::size_t>(2 * k) / 4 * 4 + 3] = 0;
      look_up_yuyv_scalar(bytes.data(), pixels, few.data(), expected.data());
      look_up_yuyv(bytes.data(), pixels, YuyvCells(few), labels.data());
      EXPECT_EQ(labels, expected) << pixels;
      EXPECT_EQ(std::ranges::count(labels, 5), 2) << k;
    }
  }
}

TEST(ColorTable, ClassifiesYuyvAsTheBoxesDo) {
  const ColorBoxes boxes;
  ColorTable table(boxes);
  const Eigen::Vector3d gain(0.96, 1.05, 1.2);
  table.set_gain(gain);
  std::mt19937 random(31);
  YuyvImage image{200, 100, std::vector<std::uint8_t>(2 * 20000)};
  std::vector<std::uint8_t>& yuyv = image.bytes;
  std::vector<std::uint8_t> labels;
  for (auto& b : yuyv) b = static_cast<std::uint8_t>(16 + random() % 220);
  table.apply(image, labels);
  ASSERT_EQ(labels.size(), 20000u);
  std::array<int, kKinds> count{};
  for (std::size_t i = 0; i < labels.size(); ++i) {
    // Middle of the cell, converted as BT.601 says: R = 1.164 (Y - 16) + 1.596 (V - 128), ...
    const double y = yuyv[2 * i] / 16 * 16 + 8, u = yuyv[i / 2 * 4 + 1] / 4 * 4 + 2,
                 v = yuyv[i / 2 * 4 + 3] / 4 * 4 + 2;
    const auto clip = [](double c) { return std::clamp(c, 0.0, 255.0); };
    const double luma = 255.0 / 219.0 * (y - 16.0);
    const Yuv color = to_yuv(gain[0] * clip(luma + 2.0172 * (u - 128)),
                             gain[1] * clip(luma - 0.3918 * (u - 128) - 0.8130 * (v - 128)),
                             gain[2] * clip(luma + 1.5960 * (v - 128)));
    int expected = 0;
    for (int k = static_cast<int>(kKinds) - 1; k > 0; --k) {
      if (boxes.of(static_cast<Kind>(k)).contains(color)) expected = k;
    }
    ASSERT_EQ(labels[i], expected) << i;
    ++count[labels[i]];
  }
  for (const int n : count) EXPECT_GT(n, 50);
  // A new gain fills the cells anew.
  const auto before = labels;
  table.set_gain(Eigen::Vector3d(1.5, 1.0, 0.7));
  table.apply(image, labels);
  EXPECT_NE(labels, before);
}

TEST(ColorTable, KnowsAColourWhoseChannelsBrightLightHasCutOff) {
  const ColorBoxes boxes;
  ColorTable table(boxes);
  ASSERT_EQ(table.label(36, 214, 224), Kind::goal_high);
  // Under bright cool light green would be 290: taken for 255 it is another colour.
  const Eigen::Vector3d gain(0.63, 0.74, 0.87);
  ASSERT_FALSE(boxes.goal_high.contains(to_yuv(57 * gain[0], 252 * gain[1], 252 * gain[2])));
  table.set_gain(gain);
  EXPECT_EQ(table.label(57, 255, 255), Kind::goal_high);
  table.set_gain(Eigen::Vector3d::Constant(0.7));
  EXPECT_EQ(table.label(255, 255, 255), Kind::none);
}

TEST(OpenLabels, LeavesWhatAnOpeningOfEachClassLeaves) {
  for (const auto& [width, height] :
       {std::pair{64, 48}, {3, 3}, {2, 9}, {9, 1}, {1, 1}, {37, 5}, {131, 40}}) {
    const auto labels = random_labels(width, height, static_cast<unsigned>(width), 6);
    std::vector<std::uint8_t> rows, opened(labels.size(), 0xee);
    open_labels(labels.data(), width, height, rows, opened.data());
    std::vector<std::uint8_t> expected(labels.size());
    for (std::size_t k = 1; k < kKinds; ++k) {
      cv::Mat mask(height, width, CV_8U), open;
      for (std::size_t i = 0; i < labels.size(); ++i) mask.data[i] = labels[i] == k ? 255 : 0;
      cv::morphologyEx(mask, open, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8U));
      for (std::size_t i = 0; i < labels.size(); ++i) {
        if (open.data[i] != 0) expected[i] = static_cast<std::uint8_t>(k);
      }
    }
    EXPECT_EQ(opened, expected) << width << "x" << height;
  }
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

}  // namespace
}  // namespace mimesis::vision
