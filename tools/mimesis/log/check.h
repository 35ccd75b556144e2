#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <functional>
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

inline constexpr std::string_view kDamage = "damage";  ///< a kind

/// Something in a log that somebody should know.
struct Finding {
  Severity severity = Severity::info;
  std::string_view kind;                ///< stable word for scripts: "seq-gap"
  std::optional<std::uint64_t> offset;  ///< in the file [bytes]
  std::string what;
};

class Findings {
 public:
  void add(Severity severity, std::string_view kind, std::optional<std::uint64_t> offset,
           std::string what) {
    list_.push_back({severity, kind, offset, std::move(what)});
  }
  template <class... Args>
  void error(std::string_view kind, std::optional<std::uint64_t> offset,
             fmt::format_string<Args...> what, Args&&... args) {
    add(Severity::error, kind, offset, fmt::format(what, std::forward<Args>(args)...));
  }
  template <class... Args>
  void warning(std::string_view kind, std::optional<std::uint64_t> offset,
               fmt::format_string<Args...> what, Args&&... args) {
    add(Severity::warning, kind, offset, fmt::format(what, std::forward<Args>(args)...));
  }
  template <class... Args>
  void info(std::string_view kind, std::optional<std::uint64_t> offset,
            fmt::format_string<Args...> what, Args&&... args) {
    add(Severity::info, kind, offset, fmt::format(what, std::forward<Args>(args)...));
  }
  /// Errors first; damage, the cause of others, before all.
  void sort() {
    std::ranges::stable_sort(list_, [](const Finding& a, const Finding& b) {
      const auto rank = [](const Finding& f) {
        return std::pair(-static_cast<int>(f.severity), f.kind != kDamage);
      };
      return rank(a) < rank(b);
    });
  }
  const std::vector<Finding>& list() const { return list_; }

 private:
  std::vector<Finding> list_;
};

/// Sequence numbers by topic, node and start of the node: they go on in the next part of a split
/// recording.
using Sequences = std::map<std::tuple<std::string, std::string, std::string>, Sequence>;

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

/// Follows the records of a log by their lengths and holds every index against what it points at:
/// message indexes, chunk index, attachment and metadata indexes, offsets of the summary. Sums are
/// not its business; behind a record that cannot be it stops and says so.
void check_structure(const log::Source& source, Findings& findings,
                     const std::function<void(std::uint64_t done)>& progress);

}  // namespace mimesis::tool
