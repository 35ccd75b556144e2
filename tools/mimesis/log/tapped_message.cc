#include "tools/mimesis/log/tapped_message.h"

namespace mimesis::tool {

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
