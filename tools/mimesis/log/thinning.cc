#include "tools/mimesis/log/thinning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {
namespace {

std::pair<std::string, std::string> split(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos) return {"", text};
  return {text.substr(0, equals), text.substr(equals + 1)};
}

}  // namespace

Thinning::Thinning(const std::vector<std::string>& every,
                   const std::vector<std::string>& max_rate) {
  for (const std::string& text : every) {
    const auto [topic, number] = split(text);
    const auto n = runtime::to_int(number);
    if (!n || *n < 1) {
      throw ConfigError(fmt::format("--every: expected N or TOPIC=N from 1, found '{}'", text));
    }
    every_[topic] = static_cast<std::uint64_t>(*n);
  }
  for (const std::string& text : max_rate) {
    const auto [topic, number] = split(text);
    const auto hz = runtime::to_double(number);
    if (!hz || *hz < 1e-6 || *hz > 1e9) {
      throw ConfigError(
          fmt::format("--max-rate: expected HZ or TOPIC=HZ above 0, found '{}'", text));
    }
    period_ns_[topic] = static_cast<std::uint64_t>(std::llround(1e9 / *hz));
  }
}

Thinning::State Thinning::state_of(const log::Channel& channel) const {
  const auto value = [&](const auto& map, std::uint64_t otherwise) {
    auto it = map.find(channel.topic);
    if (it == map.end() && !is_latched(channel)) it = map.find("");
    return it == map.end() ? otherwise : it->second;
  };
  return {value(every_, 1), 0, value(period_ns_, 0), 0};
}

bool Thinning::keep(const log::Channel& channel, std::uint64_t log_time) {
  auto it = states_.find(&channel);
  if (it == states_.end()) it = states_.emplace(&channel, state_of(channel)).first;
  State& s = it->second;
  if (s.seen++ % s.every != 0) return false;
  if (s.period_ns == 0) return true;
  if (log_time < s.due_ns) return false;
  // The times that are due form a grid, so that 100 Hz become 30 on average, not 25; after a pause
  // the grid begins anew.
  s.due_ns = std::max(s.due_ns, log_time - std::min(log_time, s.period_ns)) + s.period_ns;
  if (s.due_ns <= log_time) s.due_ns = log_time + s.period_ns;
  return true;
}

}  // namespace mimesis::tool
