#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::cdr {

enum class Kind {
  boolean,
  uint8,
  int8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string,
  wstring,
  structure
};

struct Member {
  std::string name;
  Kind kind = Kind::structure;
  std::string type{};  ///< of a structure: "pkg/Type"
  bool sequence = false;
  std::uint32_t count = 0;  ///< of an array; of a sequence: at most, 0: any
  bool list() const { return sequence || count > 0; }
};

/// Structures by name, "pkg/Type".
using Definitions = std::map<std::string, std::vector<Member>>;

/// "pkg/msg/Type" and "pkg/Type" -> "pkg/Type".
std::string short_name(std::string_view name);

/// Definitions in a schema of `name`, "pkg/Type". @throws ConfigError with the line
Definitions parse_msg(const std::string& name, std::string_view text);
Definitions parse_idl(std::string_view text);

}  // namespace mimesis::cdr
