#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_plot(CLI::App&, int&) {}

}  // namespace mimesis::tool
