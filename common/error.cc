#include "common/error.h"

#include <fmt/core.h>

#include <cstdio>
#include <cstdlib>

namespace mimesis {

void assertion_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
  std::abort();
}

std::string printable(std::string_view text, std::string_view kept) {
  std::string out;
  while (!text.empty()) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const std::size_t length = byte(0) < 0x80   ? 1
                               : byte(0) < 0xC2 ? 0
                               : byte(0) < 0xE0 ? 2
                               : byte(0) < 0xF0 ? 3
                               : byte(0) < 0xF5 ? 4
                                                : 0;
    bool plain = length > 0 && length <= text.size();
    for (std::size_t i = 1; plain && i < length; ++i) plain = (byte(i) & 0xC0) == 0x80;
    const bool control = byte(0) < 0x20 || byte(0) == 0x7F;
    if (!plain || (control && kept.find(text[0]) == std::string_view::npos)) {
      out += fmt::format("\\u{:04x}", byte(0));
      text.remove_prefix(1);
    } else if (length == 2 && byte(0) == 0xC2 && byte(1) < 0xA0) {  // U+0080 to U+009F
      out += fmt::format("\\u{:04x}", byte(1));
      text.remove_prefix(2);
    } else {
      out += text.substr(0, length);
      text.remove_prefix(length);
    }
  }
  return out;
}

}  // namespace mimesis
