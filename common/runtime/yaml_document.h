#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::runtime {

/// Where something was written; line and column count from 1. Line 0: not in a file ("--set").
struct Place {
  std::string file;
  int line = 0;
  int column = 0;
};

/// "file:line:col", or the file alone if the line is 0.
std::string to_string(const Place& place);

/// One value of a YAML file with its position. Scalars stay text until somebody who knows the
/// expected type reads them: so `no` can be a word, and `010` never becomes 8.
struct Yaml {
  enum class Kind { empty, scalar, sequence, map };
  struct Entry;

  Kind kind = Kind::empty;
  Place place;
  std::string text;            ///< of a scalar
  bool quoted = false;         ///< scalar in quotes, or a block of text
  std::vector<Yaml> items;     ///< of a sequence
  std::vector<Entry> entries;  ///< of a map, in the order of the file

  /// Value of `key` in a map; null if absent or if this is no map.
  const Yaml* find(std::string_view key) const;
  /// Keys of a map.
  std::vector<std::string> keys() const;
  /// "a list", "a map", "nothing", "'text'": for messages.
  std::string described() const;
};

struct Yaml::Entry {
  std::string key;
  Place place;  ///< of the key
  Yaml value;
};

/// Reads a file with one YAML document. @throws ConfigError "file:line:col: ..." if it is absent,
/// not YAML, or has a duplicate key, a key that is no text, a merge key (<<) or a second document.
Yaml read_yaml(const std::string& file);

/// The same for text; `name` stands for the file in positions.
Yaml parse_yaml(const std::string& text, const std::string& name);

}  // namespace mimesis::runtime
