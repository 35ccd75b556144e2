#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/image/image.h"

namespace mimesis::vision {

/// Printed chessboard. Frame B: origin at the first inner corner, x along a row of corners, y from
/// row to row, z into the paper.
struct Board {
  int columns = 9;        ///< inner corners in a row
  int rows = 6;           ///< rows of them
  double square_m = 0.0;  ///< edge of a square [m]

  std::size_t size() const { return static_cast<std::size_t>(columns * rows); }
  /// Place of a corner, row by row, in B.
  Eigen::Vector3d point(std::size_t i) const {
    const int k = static_cast<int>(i);
    return {square_m * (k % columns), square_m * (k / columns), 0.0};
  }
  Eigen::Vector3d middle() const { return 0.5 * (point(0) + point(size() - 1)); }
  /// Whether the colours tell the first corner from the last one: with an odd and an even number of
  /// corners the squares beside them differ.
  bool has_a_beginning() const { return (columns + rows) % 2 == 1; }
  std::string described() const;  ///< "9x6 inner corners, squares of 25 mm"
};

/// Corners in the order of Board::point [px].
using Corners = std::vector<Eigen::Vector2d>;

/// Board with the words of `text`, "9x6". @throws ConfigError if it is none that can be used: at
/// least 3 corners in both directions, not as many in both, since such a board could lie in four
/// ways.
Board parse_board(const std::string& text, double square_m);

/// Detection of a board in one picture.
struct Detection {
  Corners corners;
  int window_px = 0;  ///< half the edge of the window that refined them
};

/// Finds a whole board. The corners are refined to parts of a pixel in a window of at most half the
/// smallest square, because a larger one takes in the next corners' edges; they begin at a dark
/// square where the board has a beginning, else at the end nearer to the picture's upper left.
std::optional<Detection> find_board(const image::Image& image, const Board& board);

/// Inner corners (columns, rows) of whatever chessboard is there, columns >= rows; nothing if none
/// is recognised.
std::optional<std::pair<int, int>> board_size_in(const image::Image& image);

}  // namespace mimesis::vision
