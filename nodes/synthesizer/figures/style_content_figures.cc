#include "nodes/synthesizer/figures/figures.h"

namespace mimesis::synthesizer {

void add_style_content_figures(std::vector<reproduce::Figure>&) {}

}  // namespace mimesis::synthesizer
