#include "nodes/crowd/rules/gait.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::crowd {
namespace {

constexpr int kSamples = 720;        // samples of a cycle; between them extremes are refined
constexpr double kTouching = 1e-12;  // share of the mean: smaller values are zero up to rounding

}  // namespace

SpeedFunction::SpeedFunction(double mean_m_rad, std::span<const double> cosine,
                             std::span<const double> sine)
    : mean_(mean_m_rad) {
  if (cosine.size() > cosine_.size() || sine.size() > sine_.size()) {
    throw ConfigError("speed function g: at most " + std::to_string(kHarmonics) + " harmonics");
  }
  std::ranges::copy(cosine, cosine_.begin());
  std::ranges::copy(sine, sine_.begin());
  least_ = most_ = (*this)(0.0);
  for (int i = 0; i < kSamples; ++i) {
    // Newton's method to where the slope is zero; wherever it ends, g takes its value there.
    double phi = math::kTwoPi * i / kSamples;
    for (int k = 0; k < 4; ++k) {
      const double g = (*this)(phi);
      least_ = std::min(least_, g);
      most_ = std::max(most_, g);
      const auto [slope, curve] = slopes(phi);
      if (curve == 0.0) break;
      phi -= slope / curve;
    }
  }
  if (!(least_ > kTouching * mean_) || !std::isfinite(most_)) {
    throw ConfigError("speed function g: its least value is " + std::to_string(least_) +
                      " m/rad; contraction needs g > 0 at every phase");
  }
}

double SpeedFunction::operator()(double phi_rad) const {
  double g = mean_;
  for (int k = 0; k < kHarmonics; ++k) {
    const auto h = static_cast<std::size_t>(k);
    g += cosine_[h] * std::cos((k + 1) * phi_rad) + sine_[h] * std::sin((k + 1) * phi_rad);
  }
  return g;
}

std::pair<double, double> SpeedFunction::slopes(double phi_rad) const {
  double first = 0.0, second = 0.0;
  for (int k = 1; k <= kHarmonics; ++k) {
    const auto h = static_cast<std::size_t>(k - 1);
    const double c = std::cos(k * phi_rad), s = std::sin(k * phi_rad);
    first += k * (sine_[h] * c - cosine_[h] * s);
    second -= k * k * (cosine_[h] * c + sine_[h] * s);
  }
  return {first, second};
}

double SpeedFunction::integral(double phi_rad) const {
  double sum = mean_ * phi_rad;
  for (int k = 0; k < kHarmonics; ++k) {
    const auto h = static_cast<std::size_t>(k);
    sum += (cosine_[h] * std::sin((k + 1) * phi_rad) +
            sine_[h] * (1.0 - std::cos((k + 1) * phi_rad))) /
           (k + 1);
  }
  return sum;
}

double SpeedFunction::cycle_m() const { return math::kTwoPi * mean_; }

HeadingSway HeadingSway::make(std::span<const double> cosine, std::span<const double> sine) {
  HeadingSway sway;
  for (const auto& [from, to] : {std::pair(cosine, &sway.cosine), std::pair(sine, &sway.sine)}) {
    if (from.size() > to->size()) {
      throw ConfigError("sway of headings g^psi: at most " + std::to_string(kHarmonics) +
                        " harmonics");
    }
    if (!std::ranges::all_of(from, [](double a) { return std::isfinite(a); })) {
      throw ConfigError("sway of headings g^psi: expected finite numbers");
    }
    std::ranges::copy(from, to->begin());
  }
  return sway;
}

}  // namespace mimesis::crowd
