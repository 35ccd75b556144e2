#include "nodes/vision/color_table.h"

#include "common/error.h"

namespace mimesis::vision {

std::string_view name(Kind kind) {
  constexpr std::array<std::string_view, kKinds> kNames{"none",   "hand",      "object",
                                                        "bridge", "goal_high", "goal_low"};
  return kNames[static_cast<std::size_t>(kind)];
}

Yuv to_yuv(double blue, double green, double red) {
  const double y = 0.299 * red + 0.587 * green + 0.114 * blue;
  return {y, 128.0 + 0.492 * (blue - y), 128.0 + 0.877 * (red - y)};
}

const ColorBox& ColorBoxes::of(Kind kind) const {
  switch (kind) {
    case Kind::hand:
      return hand;
    case Kind::object:
      return object;
    case Kind::bridge:
      return bridge;
    case Kind::goal_high:
      return goal_high;
    case Kind::goal_low:
      return goal_low;
    case Kind::none:
      break;
  }
  MIMESIS_ASSERT(!"none has no box");
  return hand;
}

ColorTable::ColorTable(const ColorBoxes& boxes) : boxes_(boxes) {
  set_gain(Eigen::Vector3d::Ones());
}

void ColorTable::set_gain(const Eigen::Vector3d& gain_bgr) {
  gain_ = gain_bgr;
  for (unsigned i = 0; i < cells_.size(); ++i) {
    const double blue = gain_[0] * (8 * (i & 31) + 4), green = gain_[1] * (8 * (i >> 5 & 31) + 4),
                 red = gain_[2] * (8 * (i >> 10) + 4);
    const Yuv color = to_yuv(blue, green, red);
    cells_[i] = 0;
    for (std::size_t k = 1; k < kKinds && cells_[i] == 0; ++k) {
      if (boxes_.of(static_cast<Kind>(k)).contains(color)) cells_[i] = static_cast<std::uint8_t>(k);
    }
  }
}

void ColorTable::apply(const image::Image& image, std::vector<std::uint8_t>& labels) const {
  labels.resize(image.bgr.size() / 3);
  const std::uint8_t* pixel = image.bgr.data();
  for (std::uint8_t& label : labels) {
    label = cells_[cell(pixel[0], pixel[1], pixel[2])];
    pixel += 3;
  }
}

Eigen::Vector3d median_bgr(const image::Image& image) {
  constexpr std::size_t kStride = 7;  // coprime to usual widths: samples spread over all columns
  std::array<std::array<int, 256>, 3> histogram{};
  int count = 0;
  for (std::size_t i = 0; i + 2 < image.bgr.size(); i += 3 * kStride) {
    for (std::size_t c = 0; c < 3; ++c) ++histogram[c][image.bgr[i + c]];
    ++count;
  }
  Eigen::Vector3d median = Eigen::Vector3d::Zero();
  for (std::size_t c = 0; c < 3; ++c) {
    int below = 0;
    std::size_t value = 0;
    while (value < 255 && 2 * (below + histogram[c][value]) < count) below += histogram[c][value++];
    // Within the bin, by its share: finer than one level.
    const double inside =
        histogram[c][value] > 0 ? (0.5 * count - below) / histogram[c][value] : 0.5;
    median[static_cast<Eigen::Index>(c)] = static_cast<double>(value) - 0.5 + inside;
  }
  return median;
}

const Eigen::Vector3d& LightMeter::update(const image::Image& image) {
  if (reference_.isZero()) return gain_;
  constexpr double kFollow = 0.2;  // share of a new frame: light changes slowly, the hand passes
  const Eigen::Vector3d median = median_bgr(image).cwiseMax(1.0);
  const Eigen::Vector3d seen = reference_.cwiseQuotient(median).cwiseMax(0.4).cwiseMin(2.5);
  gain_ = started_ ? Eigen::Vector3d(gain_ + kFollow * (seen - gain_)) : seen;
  started_ = true;
  return gain_;
}

}  // namespace mimesis::vision
