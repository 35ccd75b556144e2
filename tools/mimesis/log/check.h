#pragma once
#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

enum class Severity { info, warning, error };
std::string_view word(Severity severity);

/// A finding in a log.
struct Finding {
  Severity severity = Severity::info;
  std::string_view kind;                ///< stable word for scripts: "seq-gap"
  std::optional<std::uint64_t> offset;  ///< in the file [bytes]
  std::string what;
};

/// Sequence numbers by topic, node and start of the node: they continue in the next part of a split
/// recording.
using Sequences = std::map<std::tuple<std::string, std::string, std::string>, Sequence>;

struct CheckedLog {
  std::string path;
  std::uint64_t size = 0;
  log::Statistics statistics = {};                ///< statistics of the records read
  std::map<std::string, std::string> split = {};  ///< metadata "mimesis.split"
  std::vector<Finding> findings = {};

  template <class... Args>
  void add(Severity severity, std::string_view kind, std::optional<std::uint64_t> offset,
           fmt::format_string<Args...> what, Args&&... args) {
    findings.push_back({severity, kind, offset, fmt::format(what, std::forward<Args>(args)...)});
  }
};

/// All findings in one file, errors first. `sequences` continue from the parts before.
CheckedLog check_log(const std::string& path, const log::Source& source, Sequences& sequences);
/// Whether the parts follow each other; findings are added to the later one.
void check_parts(std::vector<CheckedLog>& logs);

}  // namespace mimesis::tool
