#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_view(CLI::App&, int&) {}

}  // namespace mimesis::tool
