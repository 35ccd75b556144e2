#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_cat(CLI::App&, int&) {}

}  // namespace mimesis::tool
