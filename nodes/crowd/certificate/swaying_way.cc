#include "nodes/crowd/certificate/swaying_way.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::crowd {

std::pair<double, double> SwayingWay::at(double phi_rad) const {
  const double at = math::wrap_two_pi(phi_rad) / math::kTwoPi * static_cast<double>(psi_rad.size());
  const double share = at - std::floor(at);
  const std::size_t i = static_cast<std::size_t>(at) % psi_rad.size(), j = (i + 1) % psi_rad.size();
  return {psi_rad[i] + share * (psi_rad[j] - psi_rad[i]), y[i] + share * (y[j] - y[i])};
}

std::optional<SwayingWay> swaying_way(const SpeedFunction& g, const HeadingSway& sway, double gain,
                                      double ahead_m) {
  constexpr int kStored = 256, kMostCycles = 400;
  constexpr double kRepeats = 1e-9, kMostAside = 0.25 * math::kTwoPi;
  SwayingWay way{std::vector<double>(kStored), std::vector<double>(kStored)};
  if (sway.none()) return way;
  const int per_stored = std::clamp(static_cast<int>(gain / 4.0) + 1, 1, 64);
  const double h = math::kTwoPi / (kStored * per_stored);
  const auto slope = [&](double phi, const Eigen::Vector2d& x) {
    return Eigen::Vector2d(-gain * std::sin(x[0] + std::atan(x[1])) + sway(phi),
                           g(phi) * std::sin(x[0]) / ahead_m);
  };
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  for (int cycle = 0; cycle < kMostCycles; ++cycle) {
    const Eigen::Vector2d before = x;
    way.most = 0.0;
    for (int i = 0; i < kStored * per_stored; ++i) {
      if (i % per_stored == 0) {
        way.psi_rad[static_cast<std::size_t>(i / per_stored)] = x[0];
        way.y[static_cast<std::size_t>(i / per_stored)] = x[1];
      }
      way.most = std::max(way.most, x.norm());
      const double phi = i * h;
      const Eigen::Vector2d k1 = slope(phi, x), k2 = slope(phi + 0.5 * h, x + 0.5 * h * k1),
                            k3 = slope(phi + 0.5 * h, x + 0.5 * h * k2),
                            k4 = slope(phi + h, x + h * k3);
      x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    if (!x.allFinite() || way.most > kMostAside) return std::nullopt;
    if ((x - before).norm() < kRepeats) return way;
  }
  return std::nullopt;
}

}  // namespace mimesis::crowd
