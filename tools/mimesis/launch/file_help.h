#pragma once
#include <string>
#include <vector>

namespace mimesis::launch {

/// `mimesis launch FILE --help`: the comment at the head of the file, its arguments and its nodes.
/// As text for people, or one line of JSON. @throws ConfigError if it is no YAML.
std::string file_help(const std::string& file, const std::vector<std::string>& args, bool json);

/// JSON Schema of launch files, for editors: launch.schema.json.
extern const char* const kSchema;

}  // namespace mimesis::launch
