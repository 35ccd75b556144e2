#pragma once
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/error.h"

namespace mimesis::tool {

/// Columns for people: a heading, then rows, each column as wide as its widest cell. The heading is
/// bold on a terminal unless NO_COLOR is set.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> heading) : rows_{std::move(heading)} {}
  /// Number of cells: that of the heading.
  void row(std::vector<std::string> cells);
  void print(std::ostream& out, bool bold_heading) const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

/// As a shell takes it: with quotes where it needs them.
std::string shell_word(const std::string& word);

/// True if `fd` is a terminal and the user wants colour (https://no-color.org).
bool use_colour(int fd);

/// "500MB", "1.5 GB", "2GiB", "4096": bytes. Units B kB MB GB TB (powers of 1000), KiB MiB GiB TiB;
/// strictly, the whole text must fit.
std::optional<std::uint64_t> to_bytes(std::string_view text);

/// "999 B", "45.2 MB": for people.
std::string bytes_text(std::uint64_t bytes);

/// "2026-11-21 15:40:00.250 UTC" for wall time, "12.250 s" for simulated time.
std::string human_time(std::uint64_t ns);

}  // namespace mimesis::tool
