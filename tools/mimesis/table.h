#pragma once
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "common/error.h"

namespace mimesis::tool {

/// Columns for people: a heading, then rows, each column as wide as its widest cell. The heading is
/// bold on a terminal unless NO_COLOR is set.
class Table {
 public:
  explicit Table(std::vector<std::string> heading) : rows_{std::move(heading)} {}
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

}  // namespace mimesis::tool
