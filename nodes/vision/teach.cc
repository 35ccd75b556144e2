#include "nodes/vision/teach.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;

double quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Median and scaled median deviation: a standard deviation that a few strangers do not change.
std::pair<double, double> center_and_width(const std::vector<double>& values) {
  const double middle = quantile(values, 0.5);
  std::vector<double> off;
  for (const double v : values) off.push_back(std::abs(v - middle));
  return {middle, std::max(1.0, 1.4826 * quantile(off, 0.5))};
}

ColorSpot spot_of(const std::vector<Yuv>& pixels) {
  constexpr double kFar = 3.0, kNoise = 2.5, kDarkest = 20.0, kDarker = 0.2, kBrighter = 2.5;
  constexpr double kGrey = 128.0;
  std::vector<double> y, u, v;
  for (const Yuv& p : pixels) y.push_back(p.y);
  ColorSpot spot;
  spot.y = quantile(y, 0.5);
  // A region may show faces in light and in shade: each pixel counts with the chroma that it would
  // have at the common luma.
  for (const Yuv& p : pixels) {
    const double scale = spot.y / std::max(p.y, kDarkest);
    u.push_back(kGrey + scale * (p.u - kGrey));
    v.push_back(kGrey + scale * (p.v - kGrey));
  }
  const auto [u_middle, u_width] = center_and_width(u);
  const auto [v_middle, v_width] = center_and_width(v);
  double count = 0.0;
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  const Vector2d middle(u_middle, v_middle);
  Vector2d sum = Vector2d::Zero();
  for (std::size_t i = 0; i < u.size(); ++i) {
    const Vector2d off = Vector2d(u[i], v[i]) - middle;
    if (std::abs(off.x()) > kFar * u_width || std::abs(off.y()) > kFar * v_width) continue;
    sum += off;
    squares += off * off.transpose();
    ++count;
  }
  const Vector2d shift = sum / count;
  spot.mean = middle + shift;
  spot.covariance =
      squares / count - shift * shift.transpose() + kNoise * kNoise * Eigen::Matrix2d::Identity();
  // Shades and highlights have the same hue; black and glare have none.
  spot.y_min = std::max(kDarkest, kDarker * quantile(y, 0.1));
  spot.y_max = std::min(255.0, kBrighter * quantile(y, 0.9));
  return spot;
}

/// Distance of two spots in standard deviations of both together.
double apart(const ColorSpot& a, const ColorSpot& b) {
  const Vector2d off = a.mean - b.mean;
  return std::sqrt(off.dot((a.covariance + b.covariance).inverse() * off));
}

}  // namespace

ColorSpot spot_in(const ColorBox& box) {
  const double u = (box.u_max - box.u_min) / (2.0 * ColorSpots::kReach),
               v = (box.v_max - box.v_min) / (2.0 * ColorSpots::kReach);
  ColorSpot spot;
  spot.mean = {0.5 * (box.u_min + box.u_max), 0.5 * (box.v_min + box.v_max)};
  spot.covariance = Vector2d(u * u, v * v).asDiagonal();
  spot.y_min = box.y_min;
  spot.y_max = box.y_max;
  return spot;
}

std::vector<std::string> alike(const ColorSpots& spots, const Eigen::Vector3d& table_bgr) {
  constexpr double kAlike = 3.0;  // standard deviations
  std::vector<std::string> out;
  const Yuv table = to_yuv(table_bgr[0], table_bgr[1], table_bgr[2]);
  for (std::size_t k = 1; k < kKinds; ++k) {
    if (!spots.of[k]) continue;
    const auto kind = static_cast<Kind>(k);
    if (spots.of[k]->distance2(table) < kAlike * kAlike) {
      out.push_back(
          fmt::format("{} has the chroma of the table: choose a stronger colour", name(kind)));
    }
    for (std::size_t other = k + 1; other < kKinds; ++other) {
      if (!spots.of[other]) continue;
      const double distance = apart(*spots.of[k], *spots.of[other]);
      if (distance < kAlike) {
        out.push_back(
            fmt::format("{} and {} are {:.1f} standard deviations apart, expected {} or more: they "
                        "will be taken for each other",
                        name(kind), name(static_cast<Kind>(other)), distance, kAlike));
      }
    }
  }
  return out;
}

tl::expected<Lesson, Status> teach(const image::Image& image, std::span<const TaughtRegion> regions,
                                   const Eigen::Vector3d& gain_bgr) {
  constexpr int kFewest = 9;
  Lesson out;
  std::array<std::vector<Yuv>, kKinds> pixels;
  for (const TaughtRegion& r : regions) {
    if (r.left < 0 || r.top < 0 || r.width < 1 || r.height < 1 || r.left > image.width - r.width ||
        r.top > image.height - r.height) {
      return tl::unexpected(Status{
          fmt::format("{}: {}x{} pixels at ({}, {}) are not within the picture of {}x{}",
                      name(r.kind), r.width, r.height, r.left, r.top, image.width, image.height)});
    }
    auto& to = pixels.at(static_cast<std::size_t>(r.kind));
    for (int v = r.top; v < r.top + r.height; ++v) {
      for (int u = r.left; u < r.left + r.width; ++u) {
        const Eigen::Vector3d seen = bgr_at(image, u, v), c = gain_bgr.cwiseProduct(seen);
        to.push_back(to_yuv(c[0], c[1], c[2]));
        if (seen.maxCoeff() < kChannelEnd) continue;
        // It may be as it is seen, or as bright as can be behind that: the class is all between.
        const Eigen::Vector3d most = (seen.array() < kChannelEnd).select(c, kBehindEnd * c);
        to.push_back(to_yuv(most[0], most[1], most[2]));
      }
    }
  }
  for (std::size_t k = 1; k < kKinds; ++k) {
    if (pixels[k].empty()) continue;
    const auto kind = static_cast<Kind>(k);
    if (pixels[k].size() < kFewest) {
      return tl::unexpected(Status{fmt::format("{}: {} pixels are too few, expected {} or more",
                                               name(kind), pixels[k].size(), kFewest)});
    }
    out.spots.of[k] = spot_of(pixels[k]);
  }
  out.reference_bgr = gain_bgr.cwiseProduct(median_bgr(image));
  out.warnings = alike(out.spots, out.reference_bgr);
  return out;
}

}  // namespace mimesis::vision
