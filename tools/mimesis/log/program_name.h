#pragma once
#include <algorithm>
#include <cctype>
#include <string_view>

namespace mimesis::tool {

/// Whether this is the name of a file in a folder that somebody else chose: no path, nothing that a
/// shell would read.
inline bool is_file_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && name.front() != '.' && name.front() != '-' &&
         std::ranges::all_of(name, [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-' ||
                  c == '.';
         });
}

/// Whether a log may name this program: a node of Mimesis, which stands beside this program.
inline bool is_program_name(std::string_view name) {
  return is_file_name(name) && name.starts_with("mimesis_");
}

}  // namespace mimesis::tool
