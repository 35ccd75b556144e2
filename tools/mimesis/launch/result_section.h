#pragma once
#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {

/// Reads the section `result:` of a launch file.
ResultSpec read_result(Section& section);

}  // namespace mimesis::launch
