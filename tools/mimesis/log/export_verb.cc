#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_export(CLI::App&, int&) {}

}  // namespace mimesis::tool
