#include "experiments/crowd/figures.h"

namespace mimesis::crowd {

std::vector<reproduce::Figure> figures() {
  std::vector<reproduce::Figure> all;
  add_start_figures(all);
  add_rate_figures(all);
  add_leader_figures(all);
  add_movie_figures(all);
  add_speed_figure(all);
  add_frequency_figures(all);
  add_low_pass_figures(all);
  add_consensus_figures(all);
  add_cycle_figures(all);
  add_power_law_figures(all);
  add_formation_figures(all);
  add_engine_figures(all);
  add_stream_figures(all);
  add_scaling_figure(all);
  return all;
}

}  // namespace mimesis::crowd
