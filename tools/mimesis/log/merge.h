#pragma once
#include <map>
#include <string>
#include <vector>

#include "tools/mimesis/log/new_log.h"

namespace mimesis::tool {

struct MergeOptions {
  std::vector<std::string> inputs;
  OutputOptions output;
  std::map<std::string, double> offsets_s;  ///< added to all times of a file [s]
  bool json = false;
};

/// "run.mcap=-0.5" -> run.mcap, -0.5. @throws ConfigError
std::pair<std::string, double> parse_offset(const std::string& text);

/// `mimesis log merge`. Returns the exit code. @throws ConfigError
int log_merge(const MergeOptions& options);

}  // namespace mimesis::tool
