#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_replay(CLI::App&, int&) {}

}  // namespace mimesis::tool
