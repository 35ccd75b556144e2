#pragma once
#include <string>
#include <vector>

#include "tools/mimesis/log/recording.h"

namespace mimesis::tool {

/// How a recording ended.
struct RecordResult {
  std::string output;  ///< as it was asked for
  const Counts& counts;
  std::vector<std::string> files;
  std::uint64_t messages = 0;  ///< written
  std::uint64_t bytes = 0;
  std::string error;  ///< why it ended early, or empty
};

/// Counts as JSON on standard output, or as a table on standard error.
void print_json(const RecordResult& result);
void print_table(const RecordResult& result);

}  // namespace mimesis::tool
