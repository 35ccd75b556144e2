#include "nodes/vision/hand/skin_density.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::vision {
namespace {

constexpr int kCells = 160;         // across a picture, about
constexpr int kDark = 48;           // mean of a pixel's channels below which it has no colour
constexpr float kFloor = 1e-4f;     // mass of a colour that was never seen
constexpr float kMostRatio = 2.5f;  // [nat]
constexpr int kApart = 4;           // background is this many cells away from the hand

/// Human skin in chromaticities: the common part of what cameras in usual light show, narrower than
/// the locus of Soriano et al., Pattern Recognition 36:681-690, 2003.
bool may_be_skin(double red, double blue) {
  const double green = 1.0 - red - blue;
  return red > 0.36 && red < 0.60 && green > 0.22 && green < 0.37 && red > 1.1 * green &&
         green > 0.95 * blue;
}

}  // namespace

SkinDensity::SkinDensity(int width, int height)
    : width_(width), height_(height), factor_(2 * std::max(1, (width + kCells) / (2 * kCells))) {
  const auto cells =
      static_cast<std::size_t>(raster_width()) * static_cast<std::size_t>(raster_height());
  colors_.resize(4 * cells);
  near_.resize(cells);
  grown_.resize(cells);
  const int most = 3 * 255 * (factor_ / 2) * (factor_ / 2);
  share_of_.resize(static_cast<std::size_t>(most) + 1);
  for (std::size_t i = 1; i < share_of_.size(); ++i) {
    share_of_[i] = static_cast<float>(kShares) / static_cast<float>(i);
  }
}

void SkinDensity::read(const image::Image& image, Evidence& out) {
  MIMESIS_ASSERT(image.width == width_ && image.height == height_);
  const int part = factor_ / 2, dark = 3 * kDark * part * part;
  const int w = raster_width(), h = raster_height();
  const float per_pixel = 1.0f / static_cast<float>(factor_ * factor_);
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) {
      const auto cell = static_cast<std::size_t>(v * w + u);
      int luma = 0;
      for (int q = 0; q < 4; ++q) {
        int blue = 0, green = 0, red = 0;
        for (int y = 0; y < part; ++y) {
          const std::uint8_t* p =
              image.at(u * factor_ + (q & 1) * part, v * factor_ + (q >> 1) * part + y);
          for (int x = 0; x < part; ++x, p += 3) {
            blue += p[0];
            green += p[1];
            red += p[2];
          }
        }
        const int sum = blue + green + red;
        std::uint16_t color = kColors - 1;
        if (sum >= dark) {
          const float scale = share_of_[static_cast<std::size_t>(sum)];
          const int r = std::min(kShares - 1, static_cast<int>(static_cast<float>(red) * scale));
          const int b = std::min(kShares - 1, static_cast<int>(static_cast<float>(blue) * scale));
          color = static_cast<std::uint16_t>(r * kShares + b);
        }
        colors_[4 * cell + static_cast<std::size_t>(q)] = color;
        luma += 77 * red + 150 * green + 29 * blue;
      }
      out.luma[static_cast<std::size_t>(v * out.stride + u)] =
          static_cast<float>(luma) * per_pixel * (1.0f / 256.0f);
    }
  }
}

void SkinDensity::normalize(Histogram& h) {
  float sum = 0.0f;
  for (const float x : h) sum += x;
  if (!(sum > 0.0f)) return;
  for (float& x : h) x /= sum;
}

/// Smooths both histograms (1 2 1 in either direction, noise spreads colours) into the ratio.
void SkinDensity::refresh() {
  const auto smooth = [](const Histogram& from, int r, int b) {
    float sum = 0.0f;
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if (r + y < 0 || r + y >= kShares || b + x < 0 || b + x >= kShares) continue;
        const float weight = (y == 0 ? 0.5f : 0.25f) * (x == 0 ? 0.5f : 0.25f);
        sum += weight * from[static_cast<std::size_t>((r + y) * kShares + b + x)];
      }
    }
    return sum;
  };
  const auto ratio = [](float hand, float elsewhere) {
    const float r = std::log((hand + kFloor) / (elsewhere + kFloor));
    return std::clamp(r, -kMostRatio, kMostRatio);
  };
  for (int r = 0; r < kShares; ++r) {
    for (int b = 0; b < kShares; ++b) {
      const auto i = static_cast<std::size_t>(r * kShares + b);
      const float on = smooth(hand_, r, b), off = smooth(elsewhere_, r, b);
      // a colour never seen at all does not belong to the hand
      ratio_[i] = on + off < kFloor ? -0.5f : ratio(on, off);
    }
  }
  ratio_[kColors - 1] = ratio(hand_[kColors - 1], elsewhere_[kColors - 1]);
}

void SkinDensity::begin(float u, float v, float radius) {
  hand_.fill(0.0f);
  elsewhere_.fill(0.0f);
  const int w = raster_width(), h = raster_height();
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const float du = static_cast<float>(x) - u, dv = static_cast<float>(y) - v;
      const bool near = du * du + dv * dv < radius * radius;
      const auto cell = static_cast<std::size_t>(4 * (y * w + x));
      for (std::size_t q = 0; q < 4; ++q) {
        const std::uint16_t c = colors_[cell + q];
        if (!near) elsewhere_[c] += 1.0f;
        if (!near || c == kColors - 1) continue;
        const double red = (c / kShares + 0.5) / kShares, blue = (c % kShares + 0.5) / kShares;
        if (may_be_skin(red, blue)) hand_[c] += 1.0f;
      }
    }
  }
  normalize(hand_);
  normalize(elsewhere_);
  refresh();
}

void SkinDensity::learn(const HandRaster& fitted, double rate) {
  const int w = raster_width(), h = raster_height();
  const int stride = HandRaster::stride(w);
  const auto at = [stride](int u, int v) { return static_cast<std::size_t>(v * stride + u); };
  // cells close to hand or forearm, first along rows, then along columns
  for (int v = 0; v < h; ++v) {
    int last = -1000;
    const auto row = static_cast<std::size_t>(v * w);
    std::fill_n(near_.begin() + static_cast<std::ptrdiff_t>(row), w, std::uint8_t{0});
    for (int u = 0; u < w; ++u) {
      const bool on = fitted.covered()[at(u, v)] > 0.1f || fitted.forearm()[at(u, v)] > 0.1f;
      if (on) {
        for (int k = std::max({last + 1, u - kApart, 0}); k <= u; ++k)
          near_[row + static_cast<std::size_t>(k)] = 1;
        last = u;
      } else if (u - last <= kApart) {
        near_[row + static_cast<std::size_t>(u)] = 1;
      }
    }
  }
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) {
      std::uint8_t any = 0;
      for (int y = std::max(0, v - kApart); y <= std::min(h - 1, v + kApart); ++y) {
        any |= near_[static_cast<std::size_t>(y * w + u)];
      }
      grown_[static_cast<std::size_t>(v * w + u)] = any;
    }
  }
  const auto blend = [rate](Histogram& old, Histogram& fresh) {
    normalize(fresh);
    for (std::size_t i = 0; i < kColors; ++i) {
      old[i] += static_cast<float>(rate) * (fresh[i] - old[i]);
    }
  };
  for (const bool hand : {true, false}) {
    fresh_.fill(0.0f);
    float count = 0.0f;
    for (int v = 0; v < h; ++v) {
      for (int u = 0; u < w; ++u) {
        const auto cell = static_cast<std::size_t>(v * w + u);
        if (hand ? fitted.covered()[at(u, v)] < 0.99f : grown_[cell] != 0) continue;
        for (std::size_t q = 0; q < 4; ++q) {
          const std::uint16_t c = colors_[4 * cell + q];
          // a finger beside its place must not make what is there a colour of the hand
          if (hand && rate < 1.0 && ratio_[c] < 0.0f) continue;
          fresh_[c] += 1.0f;
          count += 1.0f;
        }
      }
    }
    if (count > 40.0f) blend(hand ? hand_ : elsewhere_, fresh_);
  }
  refresh();
}

void SkinDensity::judge(Evidence& out) const {
  const int w = raster_width(), h = raster_height();
  for (int v = 0; v < h; ++v) {
    for (int u = 0; u < w; ++u) {
      const std::uint16_t* c = colors_.data() + 4 * (v * w + u);
      out.ratio[static_cast<std::size_t>(v * out.stride + u)] =
          0.25f * (ratio_[c[0]] + ratio_[c[1]] + ratio_[c[2]] + ratio_[c[3]]);
    }
  }
}

}  // namespace mimesis::vision
