// Segmentation of 640x480 pictures with five classes, opened 3x3: ours against the straightforward
// pipeline of OpenCV, one thread each; their outputs are compared.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "nodes/vision/hand/testing/drawn_hand.h"
#include "nodes/vision/label_kernels.h"
#include "nodes/vision/table_watcher.h"
#include "nodes/vision/testing/yuyv_of.h"

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

struct Segmenter {
  ColorTable table{ColorBoxes{}};
  RegionFinder finder;
  std::vector<std::uint8_t> labels, rows, opened = std::vector<std::uint8_t>(640 * 480);

  void finish() {
    open_labels(labels.data(), 640, 480, rows, opened.data());
    finder.find(opened, 640, 480);
    benchmark::DoNotOptimize(finder.regions().data());
  }
  /// Whether OpenCV's opening and components of each class's mask are the same regions: area, box
  /// and centroid of every one.
  bool equals_opencv() const {
    using Key = std::array<double, 7>;
    std::vector<Key> ours, theirs;
    for (const Region& region : finder.regions()) {
      const Moments& m = region.moments;
      ours.push_back({static_cast<double>(region.kind), m.area, static_cast<double>(m.left),
                      static_cast<double>(m.top), static_cast<double>(m.right - m.left + 1),
                      std::round(1e6 * m.mean_u()), std::round(1e6 * m.mean_v())});
    }
    const cv::Mat all(480, 640, CV_8U, const_cast<std::uint8_t*>(labels.data()));
    for (std::size_t k = 1; k < kKinds; ++k) {
      cv::Mat mask = all == static_cast<double>(k), names, stats, centroids;
      cv::morphologyEx(mask, mask, cv::MORPH_OPEN, cv::Mat::ones(3, 3, CV_8U));
      const int found = cv::connectedComponentsWithStats(mask, names, stats, centroids);
      for (int i = 1; i < found; ++i) {
        const auto stat = [&](int which) { return static_cast<double>(stats.at<int>(i, which)); };
        theirs.push_back({static_cast<double>(k), stat(cv::CC_STAT_AREA), stat(cv::CC_STAT_LEFT),
                          stat(cv::CC_STAT_TOP), stat(cv::CC_STAT_WIDTH),
                          std::round(1e6 * centroids.at<double>(i, 0)),
                          std::round(1e6 * centroids.at<double>(i, 1))});
      }
    }
    std::ranges::sort(ours);
    std::ranges::sort(theirs);
    return !ours.empty() && ours == theirs;
  }
};

void bgr_to_regions(benchmark::State& state) {
  const image::Image image = scene();
  Segmenter s;
  for (auto _ : state) {
    s.table.apply(image, s.labels);
    s.finish();
  }
  state.counters["regions"] = static_cast<double>(s.finder.regions().size());
  if (!s.equals_opencv()) state.SkipWithError("OpenCV finds other regions");
}
BENCHMARK(bgr_to_regions)->Unit(benchmark::kMillisecond);

void yuyv_to_regions(benchmark::State& state) {
  const YuyvImage yuyv = yuyv_of(scene());
  Segmenter s;
  s.table.apply(yuyv, s.labels);
  for (auto _ : state) {
    s.table.apply(yuyv, s.labels);
    s.finish();
  }
  state.counters["regions"] = static_cast<double>(s.finder.regions().size());
  if (!s.equals_opencv()) state.SkipWithError("OpenCV finds other regions");
}
BENCHMARK(yuyv_to_regions)->Unit(benchmark::kMillisecond);

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
  const auto count = static_cast<std::size_t>(state.range(0));
  std::vector<DrawnHand> drawn;
  drawn.emplace_back(image::View{{0.1, 0.3, 0.7}, {0.1, 0.25, 0.0}, 560.0, 640, 480});
  drawn.emplace_back(image::View{{0.24, 0.3, 0.7}, {0.14, 0.25, 0.0}, 580.0, 640, 480});
  drawn.resize(count, drawn.front());
  HandPose pose;
  pose.p_CH = {0.0, 0.0, 0.6};
  pose.R_CH << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  const HandModel model(0.185);
  std::vector<image::Camera> cameras;
  std::vector<image::Image> images;
  for (DrawnHand& d : drawn) {
    cameras.push_back(d.camera);
    images.push_back(d.draw(model, pose, drawn.front().camera));
  }
  std::vector<const image::Image*> seen;
  for (const image::Image& i : images) seen.push_back(&i);
  HandTracker tracker({}, cameras);
  tracker.start(pose);
  tracker.step(seen);  // the search at the start takes longer
  for (auto _ : state) tracker.step(seen);
  state.counters["found"] = tracker.estimate().found;
}
BENCHMARK(hand)->Name("hand/cameras")->Arg(1)->Arg(2)->Unit(benchmark::kMillisecond);

void opencv(benchmark::State& state) {
  cv::setNumThreads(1);
  const image::Image image = scene();
  const cv::Mat bgr(480, 640, CV_8UC3, const_cast<std::uint8_t*>(image.bgr.data()));
  const ColorBoxes boxes;
  const cv::Mat square = cv::Mat::ones(3, 3, CV_8U);
  cv::Mat yuv, mask, opened, names, stats, centroids;
  const auto select = [&](std::size_t k) {
    const ColorBox& box = boxes.of(static_cast<Kind>(k));
    cv::inRange(yuv, cv::Scalar(box.y_min, box.u_min, box.v_min),
                cv::Scalar(box.y_max, box.u_max, box.v_max), mask);
  };
  for (auto _ : state) {
    cv::cvtColor(bgr, yuv, cv::COLOR_BGR2YUV);
    for (std::size_t k = 1; k < kKinds; ++k) {
      select(k);
      cv::morphologyEx(mask, opened, cv::MORPH_OPEN, square);
      cv::connectedComponentsWithStats(opened, names, stats, centroids);
      benchmark::DoNotOptimize(stats.data);
    }
  }
  // Our labels are these but for the 32 steps of a channel that the table knows; what is made of
  // labels is compared to the last pixel above (equals_opencv).
  std::vector<std::uint8_t> labels;
  ColorTable{boxes}.apply(image, labels);
  double differ = 0.0, classed = 0.0;
  for (std::size_t k = 1; k < kKinds; ++k) {
    select(k);
    for (std::size_t i = 0; i < labels.size(); ++i) {
      differ += (labels[i] == k) != (mask.data[i] != 0) ? 1.0 : 0.0;
      classed += labels[i] == k ? 1.0 : 0.0;
    }
  }
  state.counters["labels_differ"] = differ / classed;
  if (!(differ < 0.2 * classed)) state.SkipWithError("the labels differ");
}
BENCHMARK(opencv)->Name("peer/opencv")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::vision
