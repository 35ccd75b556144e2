#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "tools/mimesis/log/check_messages.h"
#include "tools/mimesis/log/finding.h"

namespace mimesis::tool {

struct CheckedLog {
  std::string path;
  std::uint64_t size = 0, messages = 0;
  std::uint64_t start_ns = 0, end_ns = 0;
  std::map<std::string, std::string> split;  ///< metadata "mimesis.split"
  Findings findings;
};

/// All findings in one file. `sequences` go on from the parts before.
CheckedLog check_log(const std::string& path, const log::Source& source, Sequences& sequences);
/// Whether the parts follow each other; findings are added to the later one.
void check_parts(std::vector<CheckedLog>& logs);

/// `mimesis log check`. Exit code 0: no errors; 1: errors; 3: a file is not there.
int log_check(const std::vector<std::string>& paths, bool json);

}  // namespace mimesis::tool
