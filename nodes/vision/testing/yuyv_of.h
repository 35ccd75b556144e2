#pragma once
#include <cmath>

#include "nodes/vision/regions.h"

namespace mimesis::vision {

/// The same picture as a camera gives it, Y0 U Y1 V (ITU-R BT.601). Width even.
inline YuyvImage yuyv_of(const image::Image& image) {
  YuyvImage out{image.width, image.height, {}};
  out.bytes.reserve(image.bgr.size() / 3 * 2);
  for (std::size_t i = 0; i < image.bgr.size(); i += 6) {
    const std::uint8_t* p = image.bgr.data() + i;
    const auto luma = [](const std::uint8_t* c) {
      return 16.0 + 0.0979 * c[0] + 0.5041 * c[1] + 0.2568 * c[2];
    };
    const double b = 0.5 * (p[0] + p[3]), g = 0.5 * (p[1] + p[4]), r = 0.5 * (p[2] + p[5]);
    for (const double value : {luma(p), 128.0 + 0.4392 * b - 0.2910 * g - 0.1482 * r, luma(p + 3),
                               128.0 - 0.0714 * b - 0.3678 * g + 0.4392 * r}) {
      out.bytes.push_back(static_cast<std::uint8_t>(std::lround(value)));
    }
  }
  return out;
}

}  // namespace mimesis::vision
