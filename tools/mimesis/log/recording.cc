#include "tools/mimesis/log/recording.h"

#include <fmt/format.h>

namespace mimesis::tool {

Count& Count::operator+=(const Count& other) {
  received += other.received;
  lost += other.lost;
  return *this;
}

void Counts::add(const Recorded& message) {
  const Count one{1, message.lost_before};
  topics[{message.topic, message.node}] += one;
  total += one;
}

void Counts::add(const Counts& other) {
  for (const auto& [key, count] : other.topics) topics[key] += count;
  total += other.total;
}

std::map<std::string, std::string> Counts::metadata() const {
  const auto text = [](const Count& count) {
    return fmt::format("received={} lost={}", count.received, count.lost);
  };
  std::map<std::string, std::string> lines{{"total", text(total)}};
  for (const auto& [key, count] : topics) {
    lines[fmt::format("{} ({})", key.first, key.second)] = text(count);
  }
  return lines;
}

log::Result Recording::add(Recorded message, WallTime now, bool from_first) {
  const auto last = last_.find({message.topic, message.node});
  if (last != last_.end() && last->second.start_id == message.start_id &&
      message.seq <= last->second.seq) {
    return {};  // a latched message, repeated
  }
  message.lost_before = lost_before(message, from_first);
  last_[{message.topic, message.node}] = {message.start_id, message.seq};
  counts_.add(message);
  if (!message.ordered) return output_(std::move(message), now);
  std::pair key{message.log_time_ns, message.node};
  held_.emplace(std::move(key), Held{std::move(message), now});
  return {};
}

std::uint64_t Recording::lost_before(const Recorded& message, bool from_first) const {
  const auto last = last_.find({message.topic, message.node});
  if (last != last_.end() && last->second.start_id == message.start_id) {
    return message.seq - last->second.seq - 1;
  }
  return from_first ? message.seq - 1 : 0;
}

log::Result Recording::advance(WallTime now) {
  // The first one held is the earliest of the graph, not the first to have come: it alone decides.
  while (!held_.empty() && held_.begin()->second.received + kHold <= now) {
    auto done = output_(std::move(held_.begin()->second.message), now);
    held_.erase(held_.begin());
    if (!done) return done;
  }
  return {};
}

log::Result Recording::finish(WallTime now) {
  for (auto& [key, held] : held_) {
    if (auto done = output_(std::move(held.message), now); !done) return done;
  }
  held_.clear();
  return {};
}

Recorded recorded(runtime::Tapped tapped, std::uint64_t now_ns) {
  Recorded m;
  m.topic = std::move(tapped.topic);
  m.type = std::move(tapped.type);
  m.type_hash = tapped.type_hash;
  m.node = std::move(tapped.message.source);
  m.start_id = tapped.message.start_id;
  m.seq = tapped.message.seq;
  m.payload = std::move(tapped.message.payload);
  m.publish_time_ns = static_cast<std::uint64_t>(tapped.message.stamp.count());
  if (tapped.publisher != nullptr) {
    m.clock = tapped.publisher->clock();
    // The clock node itself steps on the wall clock, but what it says is graph time.
    m.ordered = m.clock == "sim" || m.clock == "lockstep" ||
                m.type == v1::ClockTime::descriptor()->full_name();
    for (const auto& output : tapped.publisher->outputs()) {
      if (output.topic() == m.topic) m.latched = output.latched();
    }
  }
  if (tapped.tick.count() > 0) {
    m.log_time_ns = static_cast<std::uint64_t>(tapped.tick.count());
  } else {
    m.log_time_ns = m.ordered ? m.publish_time_ns : now_ns;
  }
  return m;
}

}  // namespace mimesis::tool
