#pragma once
#include <string_view>

namespace mimesis::tool {

constexpr int kDeepestShown = 200;  ///< deeper JSON would end this program, or what reads its lines

/// Whether brackets of a JSON text are nested deeper than `most`: what writes such a value, and
/// what reads it elsewhere, calls itself for each of them. Linear in the text's size; a text that
/// is no JSON may be either.
inline bool nested_deeper(std::string_view json, int most) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (quoted) {
      if (c == '\\') ++i;
      if (c == '"') quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if ((c == '{' || c == '[') && ++depth > most) {
      return true;
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return false;
}

}  // namespace mimesis::tool
