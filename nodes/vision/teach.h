#pragma once
#include <optional>
#include <span>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "common/image/image.h"
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
  /// Colour of the table, in the light of the spots; zero: nothing fills the picture.
  Eigen::Vector3d reference_bgr = Eigen::Vector3d::Zero();
  std::vector<std::string> warnings;  ///< what will be told apart badly
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

/// How well a camera sees the desk. Absent: the pictures do not tell.
struct CameraReport {
  /// Standard deviation of the blur of the sharpest quarter of the edges [px].
  std::optional<double> blur_px;
  double overexposed = 0.0;  ///< share of pixels with a channel at its end [1]
  double median_luma = 0.0;  ///< 0..255
  /// Share by which the brightness jumps from picture to picture, motion and drift aside [1].
  std::optional<double> flicker;
  std::vector<std::string> advice;  ///< what to change on the desk, one line each
};

/// Looks at pictures of one camera in their order: focus, exposure, flicker.
CameraReport check_camera(const std::vector<image::Image>& pictures);

/// How well the taught colours tell the things in a picture apart: advice on classes that are not
/// seen, that are seen in several places, or whose colours are alike.
/// @param reference_bgr  of the lesson
std::vector<std::string> check_colors(const image::Image& picture, const ColorSpots& spots,
                                      const Eigen::Vector3d& reference_bgr);

}  // namespace mimesis::vision
