#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/log/records.h"

namespace mimesis::tool {

/// Keeps every Nth message, or at most so many per second of log time, of each topic of each node.
/// Latched topics are thinned only if they are named: their last value is the state.
class Thinning {
 public:
  /// `every`: "[TOPIC=]N"; `max_rate`: "[TOPIC=]HZ". @throws ConfigError
  Thinning(const std::vector<std::string>& every, const std::vector<std::string>& max_rate);
  bool keep(const log::Channel& channel, std::uint64_t log_time);
  bool any() const { return !every_.empty() || !period_ns_.empty(); }

 private:
  struct State {
    std::uint64_t every = 1, seen = 0;
    std::uint64_t period_ns = 0, due_ns = 0;
  };
  State state_of(const log::Channel& channel) const;

  std::map<std::string, std::uint64_t> every_, period_ns_;  ///< by topic; "" is for all others
  std::map<const log::Channel*, State> states_;
};

}  // namespace mimesis::tool
