#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/image/image.h"
#include "nodes/vision/regions.h"

namespace mimesis::vision {

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
/// @param reference_bgr  median of the picture they were taught in, see LightMeter
std::vector<std::string> check_colors(const image::Image& picture, const ColorSpots& spots,
                                      const Eigen::Vector3d& reference_bgr);

}  // namespace mimesis::vision
