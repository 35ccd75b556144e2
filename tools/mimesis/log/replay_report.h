#pragma once
#include <string>

#include "tools/mimesis/log/replay.h"

namespace mimesis::tool {

/// What `mimesis log replay` prints; the JSON shapes are in tools/mimesis/README.md.

void print_life(const Life& life, const RunCount& count, bool json);
void print_launch(const std::string& file, const RunCount& count, bool json);

}  // namespace mimesis::tool
