#pragma once
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

}  // namespace mimesis::tool
