#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_check(CLI::App&, int&) {}

}  // namespace mimesis::tool
