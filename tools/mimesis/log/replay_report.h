#pragma once
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/mimesis/log/replay.h"

namespace mimesis::tool {

/// What `mimesis log replay` prints; the JSON shapes are in tools/mimesis/README.md.

std::string_view result_word(ReplayResult result);

/// One or several replays of one life: `report` is that of the first that was not equal, else the
/// last one.
void print_life(const Life& life, const LifeReport& report, std::uint64_t equal, std::uint64_t runs,
                bool json);

/// Lines with a table of fields. `name`: whose recording it is.
void print_difference(const std::string& name, const ReplayDifference& difference);
nlohmann::ordered_json to_json(const ReplayDifference& difference);
nlohmann::ordered_json tolerated_json(
    const std::map<std::pair<std::string, std::string>, double>& tolerated);
void print_tolerated(const std::map<std::pair<std::string, std::string>, double>& tolerated);

}  // namespace mimesis::tool
