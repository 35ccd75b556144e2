#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::synthesizer {

/// Figures of M18 chapter 3, kinematic part. Those that need recorded motion find it in
/// $MIMESIS_SHARED/data/mocap (or ../shared) and report if it is absent. The dissertation's own
/// recordings are not published: references are its printed numbers, on other data.
std::vector<reproduce::Figure> figures();

// Parts of the list, one per file.
void add_demixing_figures(std::vector<reproduce::Figure>& to);       // 3.10, 3.11
void add_style_content_figures(std::vector<reproduce::Figure>& to);  // 3.22, 3.24, 3.25
void add_blending_figures(std::vector<reproduce::Figure>& to);       // sec. 3.4.1: blending
void add_network_figures(std::vector<reproduce::Figure>& to);        // 3.31
void add_dance_figures(std::vector<reproduce::Figure>& to);          // 3.33
void add_drawer_plan_figures(std::vector<reproduce::Figure>& to);    // 3.7
void add_drawer_source_figures(std::vector<reproduce::Figure>& to);  // 3.13, 3.14
void add_drawer_weight_figures(std::vector<reproduce::Figure>& to);  // 3.15, 3.20
void add_walk_styles_figure(std::vector<reproduce::Figure>& to);     // a word
void add_drawer_motion_figures(std::vector<reproduce::Figure>& to);  // 3.37, 3.38, 3.39

}  // namespace mimesis::synthesizer
