#include "nodes/crowd/regions/region_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "common/error.h"

namespace mimesis::crowd {
namespace {

void check(const std::vector<double>& cuts, const std::string& axis) {
  for (std::size_t i = 0; i < cuts.size(); ++i) {
    if (std::isfinite(cuts[i]) && (i == 0 || cuts[i] > cuts[i - 1])) continue;
    throw ConfigError("regions." + axis +
                      "_m: expected cuts in ascending order, each a finite number");
  }
}

int part_of(const std::vector<double>& cuts, double x) {
  return static_cast<int>(std::upper_bound(cuts.begin(), cuts.end(), x) - cuts.begin());
}

/// How far x is outside of part i of the line.
double outside(const std::vector<double>& cuts, int i, double x) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const auto k = static_cast<std::size_t>(i);
  const double low = k == 0 ? -kInfinity : cuts[k - 1];
  const double high = k == cuts.size() ? kInfinity : cuts[k];
  return std::max({low - x, x - high, 0.0});
}

}  // namespace

RegionMap::RegionMap(std::vector<double> cuts_x_m, std::vector<double> cuts_y_m)
    : cuts_x_(std::move(cuts_x_m)), cuts_y_(std::move(cuts_y_m)) {
  check(cuts_x_, "x");
  check(cuts_y_, "y");
}

int RegionMap::count() const {
  return static_cast<int>((cuts_x_.size() + 1) * (cuts_y_.size() + 1));
}

int RegionMap::of(const Eigen::Vector2d& p) const {
  return part_of(cuts_x_, p.x()) + static_cast<int>(cuts_x_.size() + 1) * part_of(cuts_y_, p.y());
}

double RegionMap::outside_m(int region, const Eigen::Vector2d& p) const {
  const int columns = static_cast<int>(cuts_x_.size()) + 1;
  return std::hypot(outside(cuts_x_, region % columns, p.x()),
                    outside(cuts_y_, region / columns, p.y()));
}

int RegionMap::heir(int region, const std::vector<bool>& there) const {
  const int columns = static_cast<int>(cuts_x_.size()) + 1;
  int best = region, least = std::numeric_limits<int>::max();
  for (int r = 0; r < count(); ++r) {
    const int away =
        std::abs(r % columns - region % columns) + std::abs(r / columns - region / columns);
    if (!there[static_cast<std::size_t>(r)] || away >= least) continue;
    best = r;
    least = away;
  }
  return best;
}

int RegionMap::owner(int region, const Eigen::Vector2d& p, double margin_m) const {
  return outside_m(region, p) > margin_m ? of(p) : region;
}

}  // namespace mimesis::crowd
