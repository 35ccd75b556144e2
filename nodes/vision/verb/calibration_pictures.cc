#include "nodes/vision/verb/calibration_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "common/image/image.h"
#include "common/plot/gnuplot.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using vision::Board;

/// What tells a picture from the others of its camera -> its file.
using Named = std::map<std::string, fs::path>;

Named files_of(const std::string& from) {
  std::error_code error;
  const bool folder = fs::is_directory(from, error);
  const fs::path where = folder ? fs::path(from) : fs::path(from).parent_path();
  const std::string prefix = folder ? "" : fs::path(from).filename().string();
  Named out;
  for (const auto& entry : fs::directory_iterator(where.empty() ? "." : where, error)) {
    const std::string name = entry.path().filename().string();
    std::string ending = entry.path().extension().string();
    std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
    const bool picture = ending == ".png" || ending == ".jpg" || ending == ".jpeg";
    if (picture && name.starts_with(prefix)) {
      out[fs::path(name.substr(prefix.size())).stem().string()] = entry.path();
    }
  }
  if (error) throw ConfigError(from + ": " + error.message());
  if (out.empty()) throw ConfigError(from + ": no PNG or JPEG picture begins so");
  return out;
}

image::Image read_picture(const fs::path& file) {
  auto picture = image::read_image(file);
  if (!picture) throw ConfigError(picture.error().reason);
  return *std::move(picture);
}

/// Size of the board that most of up to six pictures show; a single opinion does not count.
std::optional<std::pair<int, int>> size_shown(const std::vector<fs::path>& files) {
  std::map<std::pair<int, int>, int> votes;
  const std::size_t step = std::max<std::size_t>(1, files.size() / 6);
  for (std::size_t i = 0; i < files.size(); i += step) {
    if (const auto size = vision::board_size_in(read_picture(files[i]))) ++votes[*size];
  }
  const auto most =
      std::ranges::max_element(votes, {}, [](const auto& vote) { return vote.second; });
  if (most == votes.end() || most->second < 2) return std::nullopt;
  return most->first;
}

/// A board of which only a part was asked for is found all the same, here another part than there.
void check_board_size(const Board& board, const std::vector<fs::path>& files, std::size_t found) {
  const auto shown = size_shown(files);
  const std::pair said(std::max(board.columns, board.rows), std::min(board.columns, board.rows));
  if (shown && *shown != said &&
      (2 * found < files.size() || shown->first > said.first || shown->second > said.second)) {
    throw ConfigError(fmt::format(
        "board: {} shows {}x{} inner corners, not {}x{}; count the corners at which four squares "
        "meet",
        files.front().string(), shown->first, shown->second, board.columns, board.rows));
  }
}

cv::Mat view_of(image::Image& image) {
  return {image.height, image.width, CV_8UC3, image.bgr.data()};
}

image::Image rectify(const image::Rectification& turned, int side, const image::Image& picture) {
  image::Image source = picture, out(picture.width, picture.height);
  cv::Mat u(out.height, out.width, CV_32F), v(out.height, out.width, CV_32F);
  for (int row = 0; row < out.height; ++row) {
    for (int column = 0; column < out.width; ++column) {
      const Vector2d from = turned.original(side, {column, row});
      u.at<float>(row, column) = static_cast<float>(from.x());
      v.at<float>(row, column) = static_cast<float>(from.y());
    }
  }
  cv::Mat to = view_of(out);
  cv::remap(view_of(source), to, u, v, cv::INTER_LINEAR);
  return out;
}

}  // namespace

CalibrationPictures read_calibration_pictures(const Board& board,
                                              const std::vector<std::string>& from) {
  std::vector<Named> named;
  for (const std::string& each : from) named.push_back(files_of(each));
  CalibrationPictures out;
  out.sizes.resize(from.size());
  std::vector<fs::path> looked_at;
  std::size_t found = 0;
  for (const Named& camera : named) {
    for (const auto& entry : camera) {
      const std::string& name = entry.first;  // clang 14 captures no structured bindings
      const bool whole =
          std::ranges::all_of(named, [&](const Named& n) { return n.contains(name); });
      const bool told = std::ranges::any_of(
          out.rejected, [&](const vision::Rejected& r) { return r.name == name; });
      if (!whole && !told)
        out.rejected.push_back({name, entry.second.string() + " has no partner"});
    }
  }
  for (const auto& [name, first_file] : named.front()) {
    vision::Shot shot{name, {}};
    std::vector<fs::path> files;
    std::string why;
    for (std::size_t c = 0; c < named.size(); ++c) {
      const auto it = named[c].find(name);
      if (it == named[c].end()) break;
      files.push_back(it->second);
      const image::Image picture = read_picture(it->second);
      vision::PictureSize& size = out.sizes[c];
      if (size.width == 0) size = {picture.width, picture.height};
      looked_at.push_back(it->second);
      if (picture.width != size.width || picture.height != size.height) {
        why = fmt::format("{} has {}x{} pixels, the first one of this camera {}x{}",
                          it->second.string(), picture.width, picture.height, size.width,
                          size.height);
      } else if (const auto seen = vision::find_board(picture, board)) {
        ++found;
        shot.seen.push_back(seen->corners);
      } else if (why.empty()) {
        why = fmt::format("no whole board of {}x{} inner corners in {}", board.columns, board.rows,
                          it->second.string());
      }
    }
    // To search for a board that is not there takes a second per picture: not in all of them.
    if (found == 0 && looked_at.size() - files.size() < 4 && looked_at.size() >= 4)
      check_board_size(board, looked_at, found);
    if (files.size() < named.size()) continue;
    if (!why.empty()) {
      out.rejected.push_back({name, why});
      continue;
    }
    out.shots.push_back(std::move(shot));
    out.files.push_back(std::move(files));
  }
  check_board_size(board, looked_at, found);
  return out;
}

image::Image corner_sheet(const Board& board, const CalibrationPictures& pictures) {
  constexpr int kColumns = 6, kTileWidth = 320;
  const auto cameras = static_cast<int>(pictures.sizes.size());
  const int tiles = cameras * static_cast<int>(pictures.shots.size());
  const int tile_height = kTileWidth * pictures.sizes[0].height / pictures.sizes[0].width;
  image::Image sheet(kColumns * kTileWidth, (tiles + kColumns - 1) / kColumns * tile_height);
  cv::Mat to = view_of(sheet);
  for (int i = 0; i < tiles; ++i) {
    const auto shot = static_cast<std::size_t>(i / cameras),
               c = static_cast<std::size_t>(i % cameras);
    image::Image picture = read_picture(pictures.files[shot][c]);
    std::vector<cv::Point2f> corners;
    for (const Vector2d& p : pictures.shots[shot].seen[c])
      corners.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
    cv::Mat view = view_of(picture);
    cv::drawChessboardCorners(view, cv::Size(board.columns, board.rows), corners, true);
    cv::putText(view, pictures.files[shot][c].stem().string(), {10, view.rows - 16},
                cv::FONT_HERSHEY_SIMPLEX, 1.2, cv::Scalar(0, 255, 255), 2, cv::LINE_AA);
    cv::Mat tile = to(
        cv::Rect(i % kColumns * kTileWidth, i / kColumns * tile_height, kTileWidth, tile_height));
    cv::resize(view, tile, tile.size(), 0.0, 0.0, cv::INTER_AREA);
  }
  return sheet;
}

image::Image rectified_pair(const image::Camera& left, const image::Camera& right,
                            const image::Image& left_picture, const image::Image& right_picture) {
  constexpr int kLines = 24;
  const image::Rectification turned(left, right);
  image::Image out(2 * left_picture.width, left_picture.height);
  cv::Mat to = view_of(out);
  int side = 0;
  for (const image::Image* picture : {&left_picture, &right_picture}) {
    image::Image half = rectify(turned, side, *picture);
    cv::Mat part =
        to(cv::Rect(side * left_picture.width, 0, left_picture.width, left_picture.height));
    cv::resize(view_of(half), part, part.size());
    ++side;
  }
  for (int v = kLines / 2; v < out.height; v += kLines) {
    cv::line(to, {0, v}, {out.width - 1, v},
             v / kLines % 2 == 0 ? cv::Scalar(0, 200, 0) : cv::Scalar(0, 160, 255));
  }
  return out;
}

void plot_calibration(const fs::path& png, const Board& board,
                      const vision::Calibrated& calibrated) {
  constexpr double kLonger = 100.0;
  constexpr std::array<const char*, 2> kWhich{"left", "right"};
  std::vector<plot::Data> data(calibrated.cameras.size());
  for (const vision::Shot& shot : calibrated.shots) {
    const auto pose = vision::locate_board(board, calibrated.cameras, shot.seen).X_FB;
    for (std::size_t c = 0; c < calibrated.cameras.size(); ++c) {
      for (std::size_t i = 0; i < board.size(); ++i) {
        const Vector2d at = shot.seen[c][i];
        const Vector2d off = at - calibrated.cameras[c].project(pose * board.point(i));
        data[c].rows.push_back({at.x(), at.y(), kLonger * off.x(), kLonger * off.y()});
      }
    }
  }
  std::string script = fmt::format("set multiplot layout 1,{}\n", data.size() + 1);
  for (std::size_t c = 0; c < data.size(); ++c) {
    const image::Lens& lens = calibrated.cameras[c].lens();
    data[c].name = kWhich.at(c);
    script += fmt::format(
        "set title '{}: residuals of corners, x {:g}'\nset xrange [0:{}]\nset yrange [{}:0]\n"
        "set size ratio -1\nset xlabel 'u [px]'\nset ylabel 'v [px]'\n"
        "plot ${} using 1:2:3:4 with vectors head size 4,20 lt 1 notitle\n",
        data.size() > 1 ? kWhich.at(c) : "camera", kLonger, lens.width_px, lens.height_px,
        kWhich.at(c));
  }
  plot::Data bars{"held", {}};
  std::string tics;
  for (std::size_t i = 0; i < calibrated.held_out.size(); ++i) {
    const vision::HeldOut& h = calibrated.held_out[i];
    bars.rows.push_back({static_cast<double>(i), h.reprojection_px, h.epipolar_px});
    tics += fmt::format("{}{} {}", i == 0 ? "" : ", ", plot::quoted(h.name), i);
  }
  data.push_back(bars);
  script += fmt::format(
      "set title 'each left out once'\nset size noratio\nset xrange [-1:{}]\nset yrange [0:*]\nset "
      "key above\n"
      "set xtics rotate ({})\nset xlabel 'position of the board'\nset ylabel 'error [px]'\nset "
      "style fill solid 0.5\n"
      "plot $held using ($1-0.2):2:(0.4) with boxes lt 1 title 'corners, rms'",
      bars.rows.size(), tics);
  if (calibrated.cameras.size() > 1)
    script +=
        ", $held using ($1+0.2):3:(0.4) with boxes lt 2 title 'epipolar lines, mean per side'";
  script += "\nunset multiplot";
  plot::plot_png(png, 520 * static_cast<int>(data.size()), 460, data, script);
}

}  // namespace mimesis::tool
