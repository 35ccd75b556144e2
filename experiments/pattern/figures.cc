#include "experiments/pattern/figures.h"

namespace mimesis::walker {

std::vector<reproduce::Figure> figures() {
  std::vector<reproduce::Figure> all;
  add_filter_figure(all);
  return all;
}

}  // namespace mimesis::walker
