#include "nodes/synthesizer/formation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

/// Place and heading of one, relative to the centre and to the formation's heading.
WalkerStart place(int i, int count, const Formation& f) {
  WalkerStart start;
  if (f.arrangement == Arrangement::circle) {
    const double radius = f.spacing_m / (2.0 * std::sin(std::numbers::pi / std::max(count, 2)));
    const double angle = math::kTwoPi * i / count;
    start.position_W_m = count > 1 ? radius * Eigen::Vector2d(std::cos(angle), std::sin(angle))
                                   : Eigen::Vector2d(0.0, 0.0);
    start.heading_rad = count > 1 ? math::wrap_pi(angle + std::numbers::pi) : 0.0;
    return start;
  }
  const int columns = f.arrangement == Arrangement::row
                          ? count
                          : static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count))));
  const int rows = (count + columns - 1) / columns;
  start.position_W_m = {f.spacing_m * (0.5 * (rows - 1) - i / columns),
                        f.spacing_m * (0.5 * (columns - 1) - i % columns)};
  return start;
}

}  // namespace

std::vector<WalkerStart> form(int count, const Formation& formation) {
  std::vector<WalkerStart> starts;
  const double c = std::cos(formation.heading_rad), s = std::sin(formation.heading_rad);
  for (int i = 0; i < count; ++i) {
    WalkerStart start = place(i, count, formation);
    const Eigen::Vector2d p = start.position_W_m;
    start.position_W_m =
        formation.centre_W_m + Eigen::Vector2d(c * p.x() - s * p.y(), s * p.x() + c * p.y());
    start.heading_rad = math::wrap_pi(start.heading_rad + formation.heading_rad);
    constexpr double kGolden = 0.6180339887498949;
    if (formation.spread_phases) start.phase_rad = math::kTwoPi * std::fmod(i * kGolden, 1.0);
    starts.push_back(start);
  }
  return starts;
}

}  // namespace mimesis::synthesizer
