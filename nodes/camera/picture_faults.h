#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/image/image.h"

namespace mimesis::camera {

/// What a real camera and real light do to a picture.
struct Faults {
  double noise = 3.0;    ///< standard deviation per channel, of 255 [1]
  double blur_px = 0.6;  ///< standard deviation of the lens' blur
  double gain = 1.0;     ///< brightness [1]
  double warmth = 1.0;   ///< red is multiplied by it, blue divided [1]
};

/// Applies blur, light and noise, in this order. Deterministic: the noise depends on seed and
/// `frame` alone.
class PictureFaults {
 public:
  PictureFaults(const Faults& faults, std::uint64_t seed);
  void apply(std::uint64_t frame, image::Image& image) const;

 private:
  void add_noise(std::uint64_t frame, image::Image& image) const;

  Faults faults_;
  std::uint64_t seed_;
  std::vector<std::int8_t>
      noise_;  ///< normally distributed, read from a different place in every row
};

}  // namespace mimesis::camera
