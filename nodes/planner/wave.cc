#include "nodes/planner/wave.h"

#include <cmath>

namespace mimesis::planner {
namespace {

std::size_t at(int node) { return static_cast<std::size_t>(node); }

/// vᵢ from its neighbours that were active at `before`.
double excitation(const Linkage& links, std::span<const double> cost, const Wave& wave, int i,
                  int before) {
  double v = 0.0;
  for (const Link& link : links[at(i)]) {
    if (wave.arrival[at(link.to)] != before) continue;
    const double c = cost.empty() ? 1.0 : 0.5 * (cost[at(i)] + cost[at(link.to)]);
    v += wave.v[at(link.to)] * std::exp(-c * link.length);
  }
  return v;
}

}  // namespace

Wave expand_wave(const Linkage& links, std::span<const char> inhibited,
                 std::span<const double> cost, int start, std::span<const int> goals) {
  Wave wave{std::vector<double>(links.size(), 0.0), std::vector<int>(links.size(), -1), false};
  std::vector<int> front, next;
  for (const int goal : goals) {
    if (inhibited[at(goal)] || wave.arrival[at(goal)] == 0) continue;
    wave.arrival[at(goal)] = 0;
    wave.v[at(goal)] = 1.0;
    front.push_back(goal);
  }
  for (int t = 1; !front.empty() && wave.arrival[at(start)] < 0; ++t) {
    next.clear();
    for (const int j : front) {
      for (const Link& link : links[at(j)]) {
        if (inhibited[at(link.to)] || wave.arrival[at(link.to)] >= 0) continue;
        wave.arrival[at(link.to)] = t;
        next.push_back(link.to);
      }
    }
    // A node joins at the first step at which any neighbour is active, so all its active neighbours
    // joined one step before: the sum runs over the old front only.
    for (const int i : next) wave.v[at(i)] = excitation(links, cost, wave, i, t - 1);
    front.swap(next);
  }
  wave.reached = wave.arrival[at(start)] >= 0;
  return wave;
}

std::vector<int> follow_wave(const Linkage& links, const Wave& wave, int start) {
  if (!wave.reached) return {};
  std::vector<int> path{start};
  for (int i = start; wave.arrival[at(i)] > 0;) {
    int best = -1;
    for (const Link& link : links[at(i)]) {
      if (wave.arrival[at(link.to)] != wave.arrival[at(i)] - 1) continue;
      if (best < 0 || wave.v[at(link.to)] > wave.v[at(best)]) best = link.to;
    }
    path.push_back(i = best);
  }
  return path;
}

}  // namespace mimesis::planner
