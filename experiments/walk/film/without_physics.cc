// Stands for the films in a build without DART.
#include <stdexcept>
#include <string>

#include "experiments/walk/figures.h"
#include "experiments/walk/film/titles.h"

namespace mimesis::walk {

std::vector<reproduce::Figure> films() {
  std::vector<reproduce::Figure> out;
  for (const FilmTitle& t : {kWalkArms, kWalkDrawer, kWalkPush}) {
    out.push_back({t.name, t.title, "M18", [name = t.name](const auto&) -> reproduce::Report {
                     throw std::runtime_error(std::string(name) +
                                              ": built without physics; tools/setup walking, then "
                                              "configure and build again");
                   }});
  }
  return out;
}

}  // namespace mimesis::walk
