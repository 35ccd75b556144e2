// vision_contact_sheet FOLDER SHEET.png [COLUMNS]: finds hands in unrelated pictures, writes them
// with the results as one sheet, and a JSON summary on standard output.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "common/image/image_file.h"
#include "nodes/vision/table_watcher.h"

namespace {

using namespace mimesis;
constexpr int kTile = 160;  // [px]

std::vector<std::filesystem::path> pictures(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    std::string ending = entry.path().extension().string();
    std::transform(ending.begin(), ending.end(), ending.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (ending == ".png" || ending == ".jpg" || ending == ".jpeg") files.push_back(entry.path());
  }
  if (error) throw ConfigError(folder + ": " + error.message());
  if (files.empty()) throw ConfigError(folder + ": no PNG or JPEG picture");
  std::sort(files.begin(), files.end());
  return files;
}

/// For hands before a plain bright wall, which serves as the reference for the light. Real skin
/// differs more from person to person than from picture to picture: a wider box than the table's.
vision::WatcherSetup setup_for(const image::Image& image) {
  vision::WatcherSetup setup;
  setup.reference_bgr.setConstant(190.0);
  setup.boxes = {};
  setup.boxes.hand = {70.0, 121.0, 137.0, 200.0, 30.0, 250.0};
  for (vision::ColorBox* other :
       {&setup.boxes.object, &setup.boxes.bar, &setup.boxes.goal_high, &setup.boxes.goal_low}) {
    *other = {1.0, 0.0, 1.0, 0.0};  // empty: only hands are sought
  }
  const int pixels = image.width * image.height;
  setup.tracker.min_hand_area = std::max(30, pixels / 50);  // a hand fills 2 % of a portrait of it
  setup.tracker.min_area = std::max(4, pixels / 2000);
  setup.tracker.gap_px = std::max(1, image.width / 30);
  return setup;
}

/// Pixels of the tracked hand turn red, its box is drawn, the rest is dimmed.
cv::Mat overlay(const image::Image& image, const vision::TableWatcher& watcher) {
  cv::Mat out(image.height, image.width, CV_8UC3);
  for (std::size_t i = 0; i < image.bgr.size(); ++i) {
    out.data[i] = static_cast<std::uint8_t>(image.bgr[i] / 2);
  }
  const vision::Blob& hand = watcher.blob(vision::Kind::hand);
  for (const vision::Run& run : watcher.runs()) {
    if (!std::binary_search(hand.regions.begin(), hand.regions.end(), run.region)) continue;
    for (int u = run.begin; u < run.end; ++u) {
      const std::uint8_t* p = image.at(u, run.row);
      out.at<cv::Vec3b>(run.row, u) = cv::Vec3b(p[0], p[1], p[2]);
    }
  }
  const vision::Moments& m = hand.moments;
  if (hand.found())
    cv::rectangle(out, {m.left, m.top}, {m.right, m.bottom}, cv::Scalar(60, 255, 60));
  return out;
}

void run(const std::string& folder, const std::string& output, int columns) {
  const auto files = pictures(folder);
  const int count = static_cast<int>(files.size());
  const int rows = (count + columns - 1) / columns;
  image::Image sheet(columns * kTile, rows * kTile);
  cv::Mat canvas(sheet.height, sheet.width, CV_8UC3, sheet.bgr.data());
  canvas.setTo(cv::Scalar(40, 40, 40));
  nlohmann::json summary{{"pictures", count},
                         {"hands", 0},
                         {"without_hand", nlohmann::json::array()},
                         {"each", nlohmann::json::array()}};
  int hands = 0;
  for (int k = 0; k < count; ++k) {
    const auto& file = files[static_cast<std::size_t>(k)];
    const auto image = image::read_image(file);
    if (!image) throw ConfigError(image.error().reason);
    vision::TableWatcher watcher(setup_for(*image));
    watcher.segment(*image);
    const vision::Moments& m = watcher.blob(vision::Kind::hand).moments;
    const bool found = watcher.blob(vision::Kind::hand).found();
    const double share = m.area / (image->width * image->height);
    hands += found ? 1 : 0;
    if (!found) summary["without_hand"].push_back(file.filename().string());
    summary["each"].push_back(
        {{"file", file.filename().string()}, {"hand", found}, {"area_share", share}});

    cv::Mat tile = overlay(*image, watcher);
    const double scale = static_cast<double>(kTile - 4) / std::max(image->width, image->height);
    cv::resize(tile, tile, {}, scale, scale, cv::INTER_AREA);
    cv::Mat place =
        canvas(cv::Rect(k % columns * kTile + 2, k / columns * kTile + 2, tile.cols, tile.rows));
    tile.copyTo(place);
    if (!found)
      cv::rectangle(place, {0, 0}, {tile.cols - 1, tile.rows - 1}, cv::Scalar(60, 60, 255), 2);
  }
  summary["hands"] = hands;
  const auto written = image::write_png(output, sheet);
  if (!written) throw ConfigError(written.error().reason);
  std::printf("%s\n", summary.dump().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: vision_contact_sheet FOLDER SHEET.png [COLUMNS]\n");
    return 2;
  }
  try {
    const int columns = argc > 3 ? std::atoi(argv[3]) : 10;
    if (columns < 1 || columns > 100) throw ConfigError("COLUMNS: expected 1..100");
    run(argv[1], argv[2], columns);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
  return 0;
}
