#pragma once
#include <string>

#include "tools/mimesis/log/new_log.h"

namespace mimesis::tool {

struct SortOptions {
  std::string input;
  OutputOptions output;
  /// So many unpacked bytes are held at most; a log that is further out of order is sorted in
  /// pieces, which stand beside the output meanwhile.
  std::size_t memory = std::size_t{512} << 20;
  bool json = false;
};

/// `mimesis log sort`: by log time, equal times in the order of the file. Reads the data, not the
/// index. Returns the exit code. @throws ConfigError
int log_sort(const SortOptions& options);

}  // namespace mimesis::tool
