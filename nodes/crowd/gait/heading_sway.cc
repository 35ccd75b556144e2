#include "nodes/crowd/gait/heading_sway.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/error.h"

namespace mimesis::crowd {

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

bool HeadingSway::none() const { return *this == HeadingSway{}; }

double HeadingSway::operator()(double phi_rad) const {
  double sum = 0.0;
  for (int k = 1; k <= kHarmonics; ++k) {
    const auto h = static_cast<std::size_t>(k - 1);
    sum += cosine[h] * std::cos(k * phi_rad) + sine[h] * std::sin(k * phi_rad);
  }
  return sum;
}

double HeadingSway::amplitude_rad(double gain) const {
  double sum = 0.0;
  for (int k = 1; k <= kHarmonics; ++k) {
    const auto h = static_cast<std::size_t>(k - 1);
    sum += std::hypot(cosine[h], sine[h]) / std::hypot(gain, k);
  }
  return sum;
}

}  // namespace mimesis::crowd
