#pragma once
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/vision/regions.h"

namespace mimesis::vision {

/// Part of a picture that shows one class and nothing else.
struct TaughtRegion {
  Kind kind = Kind::none;
  int left = 0, top = 0, width = 0, height = 0;  ///< [px]
};

/// Result of teaching with a picture.
struct Lesson {
  ColorSpots spots;
  Eigen::Vector3d reference_bgr = Eigen::Vector3d::Zero();  ///< median: the light it was taught in
  std::vector<std::string> warnings;                        ///< what will be told apart badly
};

/// Learns the colours of classes from regions of a picture. A tenth of a region may show something
/// else: what lies far from the median (3 times the scaled median deviation) does not count. The
/// spots get wider by the noise and quantisation of pictures to come, 2.5 levels in U and V.
/// @param gain_bgr turns the picture's colours into those of the light that the spots are for
/// @returns a reason if a region is not within the picture or has fewer than 9 pixels.
tl::expected<Lesson, Status> teach(const image::Image& image, std::span<const TaughtRegion> regions,
                                   const Eigen::Vector3d& gain_bgr = Eigen::Vector3d::Ones());

/// Warnings of colours that are those of the table, or of each other.
std::vector<std::string> alike(const ColorSpots& spots, const Eigen::Vector3d& table_bgr);

/// A spot that fills a box, for classes that are not taught.
ColorSpot spot_in(const ColorBox& box);

}  // namespace mimesis::vision
