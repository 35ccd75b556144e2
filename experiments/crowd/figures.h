#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::crowd {

/// Figures of M18 chapter 4 and of M10: rates beside those of the theory. The dissertation prints
/// no numbers with them; references are its formulas, with the factors that hold: α to the leader
/// [eq. 4.26], ω in the rate of rule II [4.4.2, 3].
std::vector<reproduce::Figure> figures();

// Parts of the list, one per file.
void add_rate_figures(std::vector<reproduce::Figure>& to);       // table 4.1, 4.5, 4.6
void add_start_figures(std::vector<reproduce::Figure>& to);      // 4.3, random starts
void add_leader_figures(std::vector<reproduce::Figure>& to);     // 4.7
void add_movie_figures(std::vector<reproduce::Figure>& to);      // movies 1 to 5
void add_speed_figure(std::vector<reproduce::Figure>& to);       // 4.9a
void add_frequency_figures(std::vector<reproduce::Figure>& to);  // 4.11, divergence
void add_low_pass_figures(std::vector<reproduce::Figure>& to);
void add_consensus_figures(std::vector<reproduce::Figure>& to);
void add_cycle_figures(std::vector<reproduce::Figure>& to);      // 4.12, 4.13
void add_power_law_figures(std::vector<reproduce::Figure>& to);  // 4.14
void add_formation_figures(std::vector<reproduce::Figure>& to);  // 16, 36 and 49 agents
void add_engine_figures(std::vector<reproduce::Figure>& to);     // circle, head on
void add_stream_figures(std::vector<reproduce::Figure>& to);
void add_scaling_figure(std::vector<reproduce::Figure>& to);

}  // namespace mimesis::crowd
