#pragma once
#include <string>

#include "nodes/vision/regions.h"

namespace mimesis::vision {

/// Colours of classes and the light they were taught in.
struct TaughtColors {
  Eigen::Vector3d reference_bgr = Eigen::Vector3d::Zero();  ///< see Lesson
  ColorSpots spots;
};

/// Reads what `mimesis vision teach` wrote. @throws ConfigError "file:line:col: ..." for another
/// format or version, unknown or missing keys, a class that is there twice.
TaughtColors load_colors(const std::string& file);

/// The text of such a file.
std::string colors_text(const TaughtColors& colors);

/// Class of this name. @throws ConfigError that begins with `where` and names those there are.
Kind kind_named(const std::string& name, const std::string& where);

}  // namespace mimesis::vision
