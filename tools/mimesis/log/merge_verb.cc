#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_merge(CLI::App&, int&) {}

}  // namespace mimesis::tool
