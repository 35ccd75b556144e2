#pragma once
#include <cstdint>
#include <functional>

#include "common/log/io.h"
#include "tools/mimesis/log/finding.h"

namespace mimesis::tool {

/// Follows the records of a log by their lengths and holds every index against what it points at:
/// message indexes, chunk index, attachment and metadata indexes, offsets of the summary. Sums are
/// not its business; behind a record that cannot be it stops and says so.
void check_structure(const log::Source& source, Findings& findings,
                     const std::function<void(std::uint64_t done)>& progress);

}  // namespace mimesis::tool
