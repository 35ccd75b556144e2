#include "nodes/vision/colors.h"

#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "common/error.h"

namespace mimesis::vision {

std::string_view name(Kind kind) {
  constexpr std::array<std::string_view, kKinds> kNames{"none", "hand",      "object",
                                                        "bar",  "goal_high", "goal_low"};
  return kNames[static_cast<std::size_t>(kind)];
}

Yuv to_yuv(double blue, double green, double red) {
  const double y = 0.299 * red + 0.587 * green + 0.114 * blue;
  return {y, 128.0 + 0.492 * (blue - y), 128.0 + 0.877 * (red - y)};
}

Eigen::Vector3d bgr_of_yuyv(double y, double u, double v) {
  const double luma = 255.0 / 219.0 * (y - 16.0), blue = u - 128.0, red = v - 128.0;
  return Eigen::Vector3d(luma + 2.0172 * blue, luma - 0.3918 * blue - 0.8130 * red,
                         luma + 1.5960 * red)
      .cwiseMax(0.0)
      .cwiseMin(255.0);
}

Eigen::Vector3d bgr_at(const image::Image& image, int u, int v) {
  const std::uint8_t* p = image.at(u, v);
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Eigen::Vector3d bgr_at(const YuyvImage& image, int u, int v) {
  const auto pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) +
                     static_cast<std::size_t>(u);
  const std::uint8_t* pair = image.bytes.data() + 4 * (pixel / 2);
  return bgr_of_yuyv(pair[2 * (pixel % 2)], pair[1], pair[3]);
}

const ColorBox& ColorBoxes::of(Kind kind) const {
  switch (kind) {
    case Kind::hand:
      return hand;
    case Kind::object:
      return object;
    case Kind::bar:
      return bar;
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

ColorTable::ColorTable(const ColorSpots& spots) : spots_(spots) {
  set_gain(Eigen::Vector3d::Ones());
}

double ColorSpot::distance2(const Yuv& c) const {
  if (c.y < y_min || c.y > y_max) return std::numeric_limits<double>::infinity();
  if (y == 0.0) {
    const Eigen::Vector2d off = Eigen::Vector2d(c.u, c.v) - mean;
    return off.dot(covariance.inverse() * off);
  }
  constexpr double kGrey = 128.0, kPure = 1.0 / 6.0, kHue = 1.0 / 20.0, kHalf = 0.5, kFaint = 6.0;
  const Eigen::Vector2d expected = c.y / y * (mean.array() - kGrey).matrix(),
                        chroma(c.u - kGrey, c.v - kGrey), off = chroma - expected;
  const bool faint = expected.norm() < kFaint;  // has no half that noise would leave alone
  if (!faint && chroma.dot(expected) < kHalf * expected.squaredNorm())
    return std::numeric_limits<double>::infinity();
  const Eigen::Vector2d across(-expected.y(), expected.x());
  const Eigen::Matrix2d wide = covariance + kPure * kPure * expected * expected.transpose() +
                               kHue * kHue * across * across.transpose();
  return off.dot(wide.inverse() * off);
}

Kind ColorSpots::nearest(const Yuv& color) const {
  Kind nearest = Kind::none;
  double least = kReach * kReach;
  for (std::size_t k = 1; k < kKinds; ++k) {
    if (!of[k]) continue;
    const double distance2 = of[k]->distance2(color);
    if (distance2 > least) continue;
    least = distance2;
    nearest = static_cast<Kind>(k);
  }
  return nearest;
}

Kind ColorTable::nearest(const Yuv& color) const {
  if (spots_) return spots_->nearest(color);
  for (std::size_t k = 1; k < kKinds; ++k) {
    if (boxes_.of(static_cast<Kind>(k)).contains(color)) return static_cast<Kind>(k);
  }
  return Kind::none;
}

Kind ColorTable::classify(const Eigen::Vector3d& bgr) const {
  // A channel at its end hides how bright it is: in light brighter than the reference any value up
  // to 255 of the reference light may be behind it, and of what was taught a little more.
  constexpr double kBrighter = 0.95;
  constexpr int kSteps = 4;
  Kind kind = Kind::none;
  bool clipped = true;
  for (int step = 0; step <= kSteps && clipped && kind == Kind::none; ++step) {
    Eigen::Vector3d c = gain_.cwiseProduct(bgr);
    clipped = false;
    for (int i = 0; i < 3; ++i) {
      if (bgr[i] < kChannelEnd) continue;
      const double most =
          std::max(gain_[i] < kBrighter ? 255.0 : 0.0, spots_ ? kBehindEnd * c[i] : c[i]);
      c[i] += (most - c[i]) * step / kSteps;
      clipped = true;
    }
    kind = nearest(to_yuv(c[0], c[1], c[2]));
  }
  return kind;
}

void ColorTable::set_gain(const Eigen::Vector3d& gain_bgr) {
  gain_ = gain_bgr;
  for (unsigned i = 0; i < kCells; ++i) {
    cells_[i] = static_cast<std::uint8_t>(
        classify({8.0 * (i & 31) + 4.0, 8.0 * (i >> 5 & 31) + 4.0, 8.0 * (i >> 10) + 4.0}));
  }
  yuyv_cells_.reset();
}

void ColorTable::apply(const image::Image& image, std::vector<std::uint8_t>& labels) const {
  labels.resize(image.bgr.size() / 3);
  look_up_bgr(image.bgr.data(), labels.size(), cells_.data(), labels.data());
}

void ColorTable::apply(const YuyvImage& image, std::vector<std::uint8_t>& labels) {
  if (!yuyv_cells_) {
    std::vector<std::uint8_t> cells(kYuyvCells);
    for (unsigned i = 0; i < kYuyvCells; ++i) {
      const Eigen::Vector3d bgr =
          bgr_of_yuyv(16 * (i >> 12) + 8, 4 * (i & 63) + 2, 4 * (i >> 6 & 63) + 2);
      cells[i] = static_cast<std::uint8_t>(classify(bgr));
    }
    yuyv_cells_.emplace(std::move(cells));
  }
  labels.resize(image.bytes.size() / 2);
  look_up_yuyv(image.bytes.data(), labels.size(), *yuyv_cells_, labels.data());
}

}  // namespace mimesis::vision
