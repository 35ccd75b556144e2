#include "nodes/vision/calibration/board.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;

cv::Mat grey_of(const image::Image& image) {
  const cv::Mat bgr(image.height, image.width, CV_8UC3,
                    const_cast<std::uint8_t*>(image.bgr.data()));  // OpenCV has no view of const
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

/// Mean over the squares that have the colour of the first inner one, minus that over the others.
double first_square_contrast(const cv::Mat& grey, const Corners& corners, int columns) {
  double sum[2] = {0.0, 0.0};
  int count[2] = {0, 0};
  const int rows = static_cast<int>(corners.size()) / columns;
  for (int row = 0; row + 1 < rows; ++row) {
    for (int column = 0; column + 1 < columns; ++column) {
      const auto i = static_cast<std::size_t>(row * columns + column);
      const auto below = i + static_cast<std::size_t>(columns);
      const Vector2d middle =
          0.25 * (corners[i] + corners[i + 1] + corners[below] + corners[below + 1]);
      const int u = std::clamp(static_cast<int>(std::lround(middle.x())), 0, grey.cols - 1),
                v = std::clamp(static_cast<int>(std::lround(middle.y())), 0, grey.rows - 1);
      const int colour = (row + column) % 2;
      sum[colour] += grey.at<std::uint8_t>(v, u);
      ++count[colour];
    }
  }
  return sum[0] / count[0] - sum[1] / count[1];
}

/// Rows to the right, columns down, as seen in the picture: from any corner it may have begun at.
void put_in_order(const cv::Mat& grey, const Board& board, Corners& corners) {
  const Vector2d row = corners[static_cast<std::size_t>(board.columns - 1)] - corners[0];
  const Vector2d down =
      corners[corners.size() - static_cast<std::size_t>(board.columns)] - corners[0];
  if (row.x() * down.y() - row.y() * down.x() < 0.0) {  // seen as in a mirror
    for (auto begin = corners.begin(); begin != corners.end(); begin += board.columns) {
      std::reverse(begin, begin + board.columns);
    }
  }
  const bool turned = board.has_a_beginning()
                          ? first_square_contrast(grey, corners, board.columns) > 0.0
                          : corners.back().sum() < corners.front().sum();
  if (turned) std::ranges::reverse(corners);
}

double smallest_square(const Corners& corners, int columns) {
  double least = 1e9;
  for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
    const auto below = i + static_cast<std::size_t>(columns);
    if ((i + 1) % static_cast<std::size_t>(columns) != 0)
      least = std::min(least, (corners[i + 1] - corners[i]).norm());
    if (below < corners.size()) least = std::min(least, (corners[below] - corners[i]).norm());
  }
  return least;
}

}  // namespace

std::string Board::described() const {
  return fmt::format("{}x{} inner corners, squares of {:g} mm", columns, rows, 1e3 * square_m);
}

Board parse_board(const std::string& text, double square_m) {
  Board board{0, 0, square_m};
  char more = 0;
  const bool read = std::sscanf(text.c_str(), "%3dx%3d%c", &board.columns, &board.rows, &more) == 2;
  if (!read || board.columns < 3 || board.rows < 3 || board.columns > 100 || board.rows > 100) {
    throw ConfigError(
        "board: expected the numbers of inner corners, from 3x3 on, as '9x6'; found '" + text +
        "'");
  }
  if (board.columns == board.rows) {
    throw ConfigError(fmt::format(
        "board: {} lies in the same way after a quarter turn; expected unequal numbers of inner "
        "corners, best an odd and an even one as 9x6",
        text));
  }
  return board;
}

std::optional<Detection> find_board(const image::Image& image, const Board& board) {
  constexpr int kWidestWindow = 11;
  const cv::Mat grey = grey_of(image);
  std::vector<cv::Point2f> found;
  if (!cv::findChessboardCorners(grey, cv::Size(board.columns, board.rows), found,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE) ||
      found.size() != board.size()) {
    return std::nullopt;
  }
  Detection out;
  const auto copy = [&] {
    out.corners.clear();
    for (const cv::Point2f& p : found) out.corners.emplace_back(p.x, p.y);
  };
  copy();
  // 2 w + 1 pixels are at most half of the smallest square.
  out.window_px = std::clamp(
      static_cast<int>(0.25 * smallest_square(out.corners, board.columns) - 0.5), 2, kWidestWindow);
  cv::cornerSubPix(grey, found, cv::Size(out.window_px, out.window_px), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 60, 1e-3));
  copy();
  put_in_order(grey, board, out.corners);
  return out;
}

std::optional<std::pair<int, int>> board_size_in(const image::Image& image) {
  std::vector<cv::Point2f> corners;
  cv::Mat meta;
  if (!cv::findChessboardCornersSB(grey_of(image), cv::Size(3, 3), corners,
                                   cv::CALIB_CB_LARGER | cv::CALIB_CB_NORMALIZE_IMAGE, meta)) {
    return std::nullopt;
  }
  return std::pair(std::max(meta.cols, meta.rows), std::min(meta.cols, meta.rows));
}

}  // namespace mimesis::vision
