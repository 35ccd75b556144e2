#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// Contents of one or several logs, in the shape of README.md. `sizes`: reads all messages to sum
/// their payloads per topic.
nlohmann::ordered_json info_json(const std::vector<OpenLog>& logs, bool sizes);
/// `info`, what `info_json` gave, for people.
std::string info_text(const std::vector<OpenLog>& logs, const nlohmann::ordered_json& info,
                      bool colour);

}  // namespace mimesis::tool
