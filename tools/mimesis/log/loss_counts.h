#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// What a recorder received of one topic of one node, and how many did not come.
struct LossCount {
  std::uint64_t received = 0, lost = 0;
  bool operator==(const LossCount&) const = default;
};

/// The content of metadata "mimesis.counts" of one log or the sum of several: by "TOPIC (NODE)",
/// without the total.
using LossCounts = std::map<std::string, LossCount>;

inline constexpr const char* kCountsName = "mimesis.counts";
/// Metadata of a recovered log: "TOPIC (NODE)" -> "missing=N" where that is known.
inline constexpr const char* kRecoveredName = "mimesis.recovered";

/// "TOPIC (NODE)".
std::string loss_key(const log::Channel& channel);

/// Adds what a metadata record says; what it says otherwise is left out.
void add_losses(const std::map<std::string, std::string>& metadata, LossCounts& counts);
/// Of all logs; nothing if none has counts (killed recorder, foreign log).
std::optional<LossCounts> read_losses(const std::vector<OpenLog>& logs);
/// As the recorder writes it, with the total.
log::Metadata losses_metadata(const LossCounts& counts);

}  // namespace mimesis::tool
