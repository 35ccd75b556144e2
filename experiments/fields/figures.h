#pragma once
#include <vector>

#include "experiments/harness/figure.h"

namespace mimesis::cognition {

/// Figures of M18 chapter 2 that the neural fields show.
/// M18 prints labels and orders only: times and activities beside ours are a prototype's.
std::vector<reproduce::Figure> figures();

// Parts of the list, one per file.
void add_field_figures(std::vector<reproduce::Figure>& to);       // field-bistability, 2.4
void add_copying_figures(std::vector<reproduce::Figure>& to);     // 2.17, 2.18, 2.19
void add_inference_figures(std::vector<reproduce::Figure>& to);   // 2.20, 2.21, 2.22
void add_color_figures(std::vector<reproduce::Figure>& to);       // 2.23, 2.24
void add_robustness_figures(std::vector<reproduce::Figure>& to);  // fields-jitter, -sensitivity
void add_prototype_figures(std::vector<reproduce::Figure>& to);   // fields-prototype
void add_bundle_figures(std::vector<reproduce::Figure>& to);      // fields-bundles
void add_sequence_figures(
    std::vector<reproduce::Figure>& to);  // 2.25, 2.26, 2.27, sequence-intervals

}  // namespace mimesis::cognition
