#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_convert(CLI::App&, int&) {}

}  // namespace mimesis::tool
