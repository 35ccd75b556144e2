#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_filter(CLI::App&, int&) {}

}  // namespace mimesis::tool
