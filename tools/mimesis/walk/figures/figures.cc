#include "tools/mimesis/walk/figures/figures.h"

#include "tools/mimesis/walk/figures/list.h"

namespace mimesis::walk {

std::vector<reproduce::Figure> figures() {
  constexpr std::array runs = {&power_law, &accuracy, &extremes, &zmp_spread, &naive_table, &peaks};
  static_assert(runs.size() == kTitles.size());
  std::vector<reproduce::Figure> out;
  for (std::size_t i = 0; i < kTitles.size(); ++i) {
    out.push_back({kTitles[i].name, kTitles[i].title, "M18", runs[i]});
    if (runs[i] == &extremes) out.back().film = &extremes_film;
  }
  return out;
}

}  // namespace mimesis::walk
