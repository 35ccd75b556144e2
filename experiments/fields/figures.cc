#include "experiments/fields/figures.h"

namespace mimesis::cognition {

std::vector<reproduce::Figure> figures() {
  std::vector<reproduce::Figure> all;
  add_field_figures(all);
  add_copying_figures(all);
  add_inference_figures(all);
  add_color_figures(all);
  add_robustness_figures(all);
  add_prototype_figures(all);
  add_sequence_figures(all);
  add_bundle_figures(all);
  return all;
}

}  // namespace mimesis::cognition
