#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "common/log/records.h"

namespace mimesis::log {

/// A record in the notation of the conformance suite: {"type", "fields": [[name, value], ...]},
/// numbers as decimal strings, bytes as lists of them, fields sorted by name.
nlohmann::json to_json(const Record& record);

/// Value of one field of such a record.
const nlohmann::json& field(const nlohmann::json& record, const std::string& name);
std::uint64_t number(const nlohmann::json& record, const std::string& name);
std::string text(const nlohmann::json& record, const std::string& name);
std::string bytes(const nlohmann::json& record, const std::string& name);

}  // namespace mimesis::log
