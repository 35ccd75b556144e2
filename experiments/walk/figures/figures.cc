#include "experiments/walk/figures.h"

#include "experiments/walk/figures/list.h"

namespace mimesis::walk {

std::vector<reproduce::Figure> figures() {
  constexpr std::array runs = {&power_law,  &accuracy,    &extremes, &jumps,
                               &zmp_spread, &falls_table, &peaks,    &second_robot};
  static_assert(runs.size() == kTitles.size());
  std::vector<reproduce::Figure> out;
  for (std::size_t i = 0; i < kTitles.size(); ++i) {
    const Title& t = kTitles[i];
    out.push_back({t.name, t.title, t.source, runs[i], {}, t.cpu_minutes});
    if (runs[i] == &extremes) out.back().film = &extremes_film;
    if (runs[i] == &jumps) out.back().film = &jumps_film;
  }
  return out;
}

}  // namespace mimesis::walk
