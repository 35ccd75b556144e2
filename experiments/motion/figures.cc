#include "experiments/motion/figures.h"

namespace mimesis::synthesizer {

std::vector<reproduce::Figure> figures() {
  std::vector<reproduce::Figure> all;
  add_drawer_plan_figures(all);
  add_drawer_source_figures(all);
  add_drawer_weight_figures(all);
  add_demixing_figures(all);
  add_style_content_figures(all);
  add_blending_figures(all);
  add_network_figures(all);
  add_dance_figures(all);
  add_walk_styles_figure(all);
  add_drawer_motion_figures(all);
  return all;
}

}  // namespace mimesis::synthesizer
