#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/math/convex_part.h"

namespace mimesis::robot {

/// Points are in the frame of a PCD's VIEWPOINT, or in that which it is told in: files are written
/// in both ways.
enum class Viewpoint : std::uint8_t { refuse, apply, ignore };

/// Points of a file [m], in its frame, a column each. PCD (ascii, binary, binary_compressed) and
/// PLY (ascii, binary of both byte orders), by their first bytes; other fields than x, y, z are
/// left out, and so are points that are not finite: a sensor saw nothing there.
/// @throws ConfigError "FILE: what, expected ..." in one line; of a PLY with faces, too: its
/// corners do not say where its surface is.
/// @param viewpoint  of a PCD that has one which is not the origin
Eigen::Matrix3Xd read_point_cloud(const std::string& file, Viewpoint viewpoint = Viewpoint::refuse);

/// Balls that hold all points with `radius_m` around each: one for each cell of a grid of edge
/// `cell_m` that holds any. In the order of cells. At most √3/2 cell_m + radius_m large.
std::vector<math::RoundBound> balls_of_points(const Eigen::Matrix3Xd& points, double cell_m,
                                              double radius_m);

}  // namespace mimesis::robot
