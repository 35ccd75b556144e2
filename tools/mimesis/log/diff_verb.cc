#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_diff(CLI::App&, int&) {}

}  // namespace mimesis::tool
