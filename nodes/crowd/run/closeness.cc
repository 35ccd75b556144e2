#include "nodes/crowd/run/closeness.h"

#include <algorithm>
#include <cmath>

namespace mimesis::crowd {

void Closeness::observe(std::span<const Disc> discs) {
  sorted_.assign(discs.begin(), discs.end());
  std::ranges::sort(sorted_, {}, [](const Disc& d) { return std::pair(d.x_m, d.id); });
  double widest = 0.0;
  for (const Disc& d : sorted_) widest = std::max(widest, d.radius_m);
  before_.swap(overlapping_);
  overlapping_.clear();
  for (std::size_t i = 0; i < sorted_.size(); ++i) {
    const Disc& a = sorted_[i];
    for (std::size_t j = i + 1; j < sorted_.size(); ++j) {
      const Disc& b = sorted_[j];
      // The nearest pair so far bounds how far along x a nearer one can be.
      const double nearer =
          std::max(a.radius_m + widest + std::max(least_gap_m_, 0.0), least_distance_m_);
      if (b.x_m - a.x_m > nearer) break;
      if (!(a.id < b.id ? a : b).counts) continue;
      const double distance = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
      const double gap = distance - a.radius_m - b.radius_m;
      least_distance_m_ = std::min(least_distance_m_, distance);
      least_gap_m_ = std::min(least_gap_m_, gap);
      if (gap < -slack_m_) overlapping_.emplace_back(std::min(a.id, b.id), std::max(a.id, b.id));
    }
  }
  std::ranges::sort(overlapping_);
  for (const auto& pair : overlapping_) {
    collisions_ += std::ranges::binary_search(before_, pair) ? 0 : 1;
  }
}

}  // namespace mimesis::crowd
