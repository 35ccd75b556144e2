#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "nodes/vision/calibration/calibration.h"

namespace mimesis::tool {

/// The pictures of a calibration and what was found in them.
struct CalibrationPictures {
  std::vector<vision::PictureSize> sizes;  ///< per camera
  std::vector<vision::Shot> shots;         ///< with a whole board in every picture
  std::vector<vision::Rejected> rejected;  ///< without partner, of another size, without a board
  /// Files of each shot, per camera.
  std::vector<std::vector<std::filesystem::path>> files;
};

/// A camera's pictures: what tells one from the others, the same in all cameras -> its file.
using NamedPictures = std::map<std::string, std::filesystem::path>;

/// The PNG and JPEG files of each camera. Pictures of one instant are told by what follows the
/// common beginning of their names ("left07.jpg" and "right07.jpg"); if that gives fewer pairs, by
/// their words and numbers without the side (left, right, l, r, the number of a cam) and without
/// zeros before numbers ("7_l", "imgRight007"); if that gives none, by their last numbers.
/// @param from per camera a folder, or the beginning of the files' paths ("calibration/left"); one
///   folder for both cameras if names say the side
/// @param rejected gets pictures without a partner, and two of one name
/// @throws ConfigError if a camera has none.
std::vector<NamedPictures> pictures_by_name(const std::vector<std::string>& from,
                                            std::vector<vision::Rejected>& rejected);

/// Reads these files and finds the board in them.
/// @throws ConfigError as pictures_by_name, or if they show a board with other corners than said.
CalibrationPictures read_calibration_pictures(const vision::Board& board,
                                              const std::vector<std::string>& from);

/// All pictures small, corners joined row by row in the colours of OpenCV's samples: a jump in the
/// order is seen at once. One row per shot and camera, six columns.
image::Image corner_sheet(const vision::Board& board, const CalibrationPictures& pictures);

/// A pair turned until its rows agree, side by side, with lines every 24 rows: whatever a line
/// meets on the left it must meet on the right.
image::Image rectified_pair(const image::Camera& left, const image::Camera& right,
                            const image::Image& left_picture, const image::Image& right_picture);

/// Residuals of all corners as arrows, 100 times too long, and held-out errors per shot as bars; a
/// PNG file. @throws std::runtime_error as plot::plot_png.
void plot_calibration(const std::filesystem::path& png, const vision::Board& board,
                      const vision::Calibrated& calibrated);

}  // namespace mimesis::tool
