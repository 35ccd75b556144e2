// Stands for figures.cc in a build without DART.
#include <stdexcept>
#include <string>

#include "experiments/walk/figures/list.h"

namespace mimesis::walk {

std::vector<reproduce::Figure> figures() {
  std::vector<reproduce::Figure> out;
  for (const Title& t : kTitles) {
    out.push_back({t.name,
                   t.title,
                   t.source,
                   [name = t.name](const auto&) -> reproduce::Report {
                     throw std::runtime_error(std::string(name) +
                                              ": built without physics; tools/setup walking, then "
                                              "configure and build again");
                   },
                   {},
                   t.cpu_minutes});
  }
  return out;
}

}  // namespace mimesis::walk
