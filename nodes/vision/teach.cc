#include "nodes/vision/teach.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

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
  ColorCount colors;
  colors.count(image);
  if (const auto table = colors.filling_bgr()) out.reference_bgr = gain_bgr.cwiseProduct(*table);
  out.warnings = alike(out.spots, gain_bgr.cwiseProduct(median_bgr(image)));
  return out;
}

namespace {

std::vector<float> luma_of(const image::Image& image) {
  std::vector<float> out(image.bgr.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::uint8_t* p = image.bgr.data() + 3 * i;
    out[i] = static_cast<float>(to_yuv(p[0], p[1], p[2]).y);
  }
  return out;
}

double share_at(std::vector<float>& values, double share) {
  const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return static_cast<double>(*at);
}

/// A step that was blurred by σ is as steep as its height / (σ √(2π)): the blur of each high step
/// along a row, from its height between the ends of the slope and its steepest place.
std::optional<double> blur_of(const std::vector<float>& luma, int width) {
  constexpr float kHigh = 40.0f;      // levels: noise makes no such steps
  constexpr std::size_t kFew = 30;    // steps
  constexpr double kSharpest = 0.25;  // shadows and round things are soft in focus, too
  std::vector<float> widths;
  for (std::size_t row = 0; row + static_cast<std::size_t>(width) <= luma.size();
       row += static_cast<std::size_t>(width)) {
    const float* p = luma.data() + row;
    for (int from = 0; from + 1 < width;) {
      const bool up = p[from + 1] > p[from];
      int to = from + 1;
      float steepest = std::abs(p[to] - p[from]);
      for (; to + 1 < width && (p[to + 1] > p[to]) == up && p[to + 1] != p[to]; ++to)
        steepest = std::max(steepest, std::abs(p[to + 1] - p[to]));
      const float height = std::abs(p[to] - p[from]);
      if (height > kHigh)
        widths.push_back(height / steepest / std::sqrt(2.0f * std::numbers::pi_v<float>));
      from = to;
    }
  }
  if (widths.size() < kFew) return std::nullopt;
  return share_at(widths, kSharpest);
}

/// rms of what a picture's brightness differs from the mean of its neighbours, over the mean.
std::optional<double> flicker_of(const std::vector<double>& brightness) {
  if (brightness.size() < 3) return std::nullopt;
  double squares = 0.0, sum = 0.0;
  for (std::size_t i = 1; i + 1 < brightness.size(); ++i) {
    const double off = brightness[i] - 0.5 * (brightness[i - 1] + brightness[i + 1]);
    squares += off * off;
    sum += brightness[i];
  }
  const double n = static_cast<double>(brightness.size() - 2);
  return std::sqrt(squares / n) / std::max(1.0, sum / n);
}

}  // namespace

CameraReport check_camera(const std::vector<image::Image>& pictures) {
  constexpr double kBlurred_px = 1.5, kBright = 0.02, kDark = 45.0, kFlicker = 0.02;
  constexpr int kEnd = 250;  // of 255: the channel tells no more
  CameraReport out;
  std::vector<double> brightness, blurs, medians;
  std::size_t at_end = 0, all = 0;
  for (const image::Image& picture : pictures) {
    std::vector<float> luma = luma_of(picture);
    if (luma.empty()) continue;
    if (const auto blur = blur_of(luma, picture.width)) blurs.push_back(*blur);
    double sum = 0.0;
    for (const float y : luma) sum += static_cast<double>(y);
    brightness.push_back(sum / static_cast<double>(luma.size()));
    for (std::size_t i = 0; i < luma.size(); ++i) {
      const std::uint8_t* p = picture.bgr.data() + 3 * i;
      at_end += std::max({p[0], p[1], p[2]}) >= kEnd ? 1 : 0;
    }
    all += luma.size();
    medians.push_back(share_at(luma, 0.5));
  }
  if (all == 0) return out;
  std::ranges::sort(blurs);
  std::ranges::sort(medians);
  if (!blurs.empty()) out.blur_px = blurs[blurs.size() / 2];
  out.median_luma = medians[medians.size() / 2];
  out.overexposed = static_cast<double>(at_end) / static_cast<double>(all);
  out.flicker = flicker_of(brightness);

  if (!out.blur_px)
    out.advice.emplace_back("focus: no sharp edge of 40 levels is in view: put the things there");
  if (out.blur_px > kBlurred_px) {
    out.advice.push_back(
        fmt::format("focus: edges are blurred by {:.1f} px, expected {} or less: turn the focus "
                    "ring, clean the lens",
                    *out.blur_px, kBlurred_px));
  }
  if (out.overexposed > kBright) {
    out.advice.push_back(
        fmt::format("exposure: {:.1f} % of the pixels are at the white end, expected {:.0f} % or "
                    "less: shorten the exposure, turn the lamp away",
                    100.0 * out.overexposed, 100.0 * kBright));
  }
  if (out.median_luma < kDark) {
    out.advice.push_back(
        fmt::format("exposure: the median luma is {:.0f} of 255, expected {:.0f} or more: more "
                    "light, a longer exposure",
                    out.median_luma, kDark));
  }
  if (out.flicker > kFlicker) {
    out.advice.push_back(
        fmt::format("flicker: the brightness jumps by {:.1f} % from picture to picture, expected "
                    "{:.0f} % or less: lock the exposure, to a multiple of 10 ms under 50 Hz lamps",
                    100.0 * *out.flicker, 100.0 * kFlicker));
  }
  return out;
}

std::vector<std::string> check_colors(const image::Image& picture, const ColorSpots& spots,
                                      const Eigen::Vector3d& reference_bgr) {
  constexpr double kSpeck = 30.0, kLarge = 0.2;  // pixels; share of the largest region
  std::vector<std::string> out = alike(spots, reference_bgr);
  Segmentation segmentation(ColorTable(spots), LightMeter(spots, reference_bgr), false);
  segmentation.segment(picture);
  for (std::size_t k = 1; k < kKinds; ++k) {
    if (!spots.of[k]) continue;
    const auto kind = static_cast<Kind>(k);
    std::vector<Moments> seen;
    for (const Region& r : segmentation.regions()) {
      if (r.kind == kind && r.moments.area >= kSpeck) seen.push_back(r.moments);
    }
    std::ranges::stable_sort(seen, std::greater{}, &Moments::area);
    if (seen.empty()) {
      out.push_back(
          fmt::format("colours: {} is not in view, or its colour is not the taught one "
                      "in this light: teach it anew",
                      name(kind)));
    }
    for (std::size_t i = 1; i < seen.size() && seen[i].area > kLarge * seen[0].area; ++i) {
      out.push_back(fmt::format(
          "colours: {} at ({:.0f}, {:.0f}) px and at ({:.0f}, {:.0f}) px: if "
          "one of them is something else, take it off the desk",
          name(kind), seen[0].mean_u(), seen[0].mean_v(), seen[i].mean_u(), seen[i].mean_v()));
    }
  }
  return out;
}

}  // namespace mimesis::vision
