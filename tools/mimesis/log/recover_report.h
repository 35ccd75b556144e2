#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "tools/mimesis/log/recover.h"

namespace mimesis::tool {

/// What is missing, one line each: damaged places, then gaps by topic.
std::string recovery_text(const std::string& input, const Recovered& recovered);
/// {"complete","lost","damages":[..],"topics":[..]}
nlohmann::ordered_json recovery_json(const std::string& input, const Recovered& recovered);

}  // namespace mimesis::tool
