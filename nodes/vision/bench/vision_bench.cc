// Segmentation of 640x480 pictures with five classes: ours against the straightforward pipeline of
// OpenCV, one thread each, neither with an opening; their outputs are compared.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "nodes/vision/hand/test/drawn_hand.h"
#include "nodes/vision/table_watcher.h"

namespace mimesis::vision {
namespace {

/// Five coloured shapes and 20 dots of clutter on grey, with noise of 12 levels.
image::Image scene() {
  image::Image image(640, 480);
  cv::Mat view(480, 640, CV_8UC3, image.bgr.data());
  view.setTo(cv::Scalar(150, 152, 155));
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) {
    const cv::Point at(static_cast<int>(random() % 640), static_cast<int>(random() % 480));
    cv::Scalar color;
    for (int c = 0; c < 3; ++c) color[c] = static_cast<double>(random() % 256);
    cv::circle(view, at, 4, color, cv::FILLED);
  }
  cv::ellipse(view, {150, 180}, {120, 35}, 25, 0, 360, cv::Scalar(116, 152, 220), cv::FILLED);
  cv::rectangle(view, {240, 260, 40, 70}, cv::Scalar(90, 200, 90), cv::FILLED);
  cv::rectangle(view, {300, 150, 90, 40}, cv::Scalar(205, 96, 38), cv::FILLED);
  cv::rectangle(view, {520, 260, 70, 30}, cv::Scalar(36, 214, 224), cv::FILLED);
  cv::rectangle(view, {410, 310, 60, 30}, cv::Scalar(196, 62, 158), cv::FILLED);
  std::normal_distribution<double> noise(0.0, 12.0);
  for (auto& byte : image.bgr) {
    byte = static_cast<std::uint8_t>(std::clamp(byte + noise(random), 0.0, 255.0));
  }
  return image;
}

void table_and_runs(benchmark::State& state) {
  const image::Image image = scene();
  const ColorTable table{ColorBoxes{}};
  RegionFinder finder;
  std::vector<std::uint8_t> labels;
  for (auto _ : state) {
    table.apply(image, labels);
    finder.find(labels, image.width, image.height);
    benchmark::DoNotOptimize(finder.regions().data());
  }
  state.counters["regions"] = static_cast<double>(finder.regions().size());
}
BENCHMARK(table_and_runs)->Unit(benchmark::kMillisecond);

void table_only(benchmark::State& state) {
  const image::Image image = scene();
  const ColorTable table{ColorBoxes{}};
  std::vector<std::uint8_t> labels;
  for (auto _ : state) {
    table.apply(image, labels);
    benchmark::DoNotOptimize(labels.data());
  }
}
BENCHMARK(table_only)->Unit(benchmark::kMillisecond);

void picture_to_symbols(benchmark::State& state) {
  const image::Image image = scene();
  TableWatcher watcher{WatcherSetup{}};
  for (auto _ : state) watcher.watch(image);
}
BENCHMARK(picture_to_symbols)->Unit(benchmark::kMillisecond);

/// A picture of each of one or two cameras to the hand's pose.
void hand(benchmark::State& state) {
  const auto cameras = static_cast<std::size_t>(state.range(0));
  std::vector<DrawnHand> drawn;
  drawn.emplace_back(image::View{{0.1, 0.3, 0.7}, {0.1, 0.25, 0.0}, 560.0, 640, 480});
  drawn.emplace_back(image::View{{0.24, 0.3, 0.7}, {0.14, 0.25, 0.0}, 580.0, 640, 480});
  drawn.resize(cameras, drawn.front());
  HandPose pose;
  pose.p_CH = {0.0, 0.0, 0.6};
  pose.R_CH << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  const HandModel model(true, 0.185);
  std::vector<image::Pinhole> pinholes;
  std::vector<image::Image> images;
  for (DrawnHand& d : drawn) {
    pinholes.push_back(d.pinhole);
    images.push_back(d.draw(model, pose, drawn.front().pinhole));
  }
  std::vector<const image::Image*> seen;
  for (const image::Image& i : images) seen.push_back(&i);
  HandTracker tracker({.left = true}, pinholes);
  tracker.start(pose);
  tracker.step(seen);  // the search at the start takes longer
  for (auto _ : state) tracker.step(seen);
  state.counters["found"] = tracker.estimate().found;
}
BENCHMARK(hand)->Name("hand/cameras")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);

/// Largest component of a class: pixels, centroid.
struct Largest {
  double area = 0.0, u = 0.0, v = 0.0;
};

/// The largest component of every class must be ours, but for the 32 steps of a channel that the
/// table knows. Says how far they are apart.
void compare(benchmark::State& state, const image::Image& image,
             const std::array<Largest, kKinds>& theirs) {
  std::vector<std::uint8_t> labels;
  RegionFinder finder;
  ColorTable{ColorBoxes{}}.apply(image, labels);
  finder.find(labels, image.width, image.height);
  std::array<Largest, kKinds> ours;
  for (const Region& region : finder.regions()) {
    Largest& most = ours[static_cast<std::size_t>(region.kind)];
    const Moments& m = region.moments;
    if (m.area > most.area) most = {m.area, m.mean_u(), m.mean_v()};
  }
  double apart_px = 0.0, area = 0.0;
  for (std::size_t k = 1; k < kKinds; ++k) {
    apart_px = std::max(apart_px, std::hypot(ours[k].u - theirs[k].u, ours[k].v - theirs[k].v));
    area = std::max(area, std::abs(ours[k].area / theirs[k].area - 1.0));
  }
  state.counters["apart_px"] = apart_px;
  state.counters["area_differs"] = area;
  if (!(apart_px < 0.1 && area < 0.05)) state.SkipWithError("the outputs differ");
}

void opencv(benchmark::State& state) {
  cv::setNumThreads(1);
  const image::Image image = scene();
  const cv::Mat bgr(480, 640, CV_8UC3, const_cast<std::uint8_t*>(image.bgr.data()));
  const ColorBoxes boxes;
  cv::Mat yuv, mask, names, stats, centroids;
  std::array<Largest, kKinds> largest;
  for (auto _ : state) {
    cv::cvtColor(bgr, yuv, cv::COLOR_BGR2YUV);
    for (std::size_t k = 1; k < kKinds; ++k) {
      const ColorBox& box = boxes.of(static_cast<Kind>(k));
      cv::inRange(yuv, cv::Scalar(box.y_min, box.u_min, box.v_min),
                  cv::Scalar(box.y_max, box.u_max, box.v_max), mask);
      const int found = cv::connectedComponentsWithStats(mask, names, stats, centroids);
      largest[k] = {};
      for (int i = 1; i < found; ++i) {
        const double area = stats.at<int>(i, cv::CC_STAT_AREA);
        if (area > largest[k].area)
          largest[k] = {area, centroids.at<double>(i, 0), centroids.at<double>(i, 1)};
      }
    }
  }
  compare(state, image, largest);
}
BENCHMARK(opencv)->Name("peer/opencv")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::vision
