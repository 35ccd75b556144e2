#pragma once
#include "common/runtime/raw.h"
#include "tools/mimesis/log/recording.h"

namespace mimesis::tool {

/// As it goes into a log. Its log time: on a simulated clock the graph's, so that equal runs give
/// equal logs; else its receipt, `now_ns`.
Recorded recorded(runtime::Tapped tapped, std::uint64_t now_ns);

}  // namespace mimesis::tool
