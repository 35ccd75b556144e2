#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_recover(CLI::App&, int&) {}

}  // namespace mimesis::tool
