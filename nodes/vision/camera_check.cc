#include "nodes/vision/camera_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nodes/vision/teach.h"

namespace mimesis::vision {
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
  Segmentation segmentation(ColorTable(spots), LightMeter(reference_bgr), false);
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
