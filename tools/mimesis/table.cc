#include "tools/mimesis/table.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <ostream>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::tool {
namespace {

/// Characters, not bytes, of UTF-8.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
  }));
}

}  // namespace

void TextTable::row(std::vector<std::string> cells) {
  MIMESIS_ASSERT(cells.size() == rows_.front().size());
  for (std::string& cell : cells) cell = printable(cell);
  rows_.push_back(std::move(cells));
}

void TextTable::print(std::ostream& out, bool bold_heading) const {
  std::vector<std::size_t> widths(rows_.front().size(), 0);
  for (const auto& cells : rows_) {
    for (std::size_t i = 0; i < cells.size(); ++i) widths[i] = std::max(widths[i], width(cells[i]));
  }
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    std::string line;
    for (std::size_t i = 0; i < rows_[r].size(); ++i) {
      line += rows_[r][i];
      if (i + 1 < rows_[r].size()) line += std::string(widths[i] - width(rows_[r][i]) + 2, ' ');
    }
    const bool bold = r == 0 && bold_heading;
    out << (bold ? "\033[1m" : "") << line << (bold ? "\033[0m" : "") << '\n';
  }
}

std::string shell_word(const std::string& word) {
  static constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

bool use_colour(int fd) {
  const char* no_color = std::getenv("NO_COLOR");
  return (no_color == nullptr || *no_color == '\0') && isatty(fd) != 0;
}

std::optional<std::uint64_t> to_bytes(std::string_view text) {
  static constexpr runtime::TextUnit kUnits[] = {
      {"", 1.0},    {"B", 1.0},      {"kB", 1e3},        {"MB", 1e6},     {"GB", 1e9},
      {"TB", 1e12}, {"KiB", 1024.0}, {"MiB", 1048576.0}, {"GiB", 0x1p30}, {"TiB", 0x1p40}};
  const auto bytes = runtime::to_amount(text, kUnits);
  return bytes ? std::optional(static_cast<std::uint64_t>(std::llround(*bytes))) : std::nullopt;
}

std::string bytes_text(std::uint64_t bytes) {
  static constexpr std::array kNames = {"kB", "MB", "GB", "TB"};
  if (bytes < 1000) return fmt::format("{} B", bytes);
  auto value = static_cast<double>(bytes) / 1e3;
  std::size_t name = 0;
  for (; value >= 999.95 && name + 1 < kNames.size(); ++name) value /= 1e3;
  return fmt::format("{:.1f} {}", value, kNames[name]);
}

std::string human_time(std::uint64_t ns) {
  constexpr std::uint64_t kYear2000 = 946684800ull * 1'000'000'000;  // later ones are wall time
  if (ns < kYear2000) return fmt::format("{:.3f} s", static_cast<double>(ns) * 1e-9);
  const auto whole = static_cast<std::time_t>(ns / 1'000'000'000);
  return fmt::format("{:%Y-%m-%d %H:%M:%S}.{:03} UTC", fmt::gmtime(whole), ns / 1'000'000 % 1000);
}

}  // namespace mimesis::tool
