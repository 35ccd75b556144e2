#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_sort(CLI::App&, int&) {}

}  // namespace mimesis::tool
