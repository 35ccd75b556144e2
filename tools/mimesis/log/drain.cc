#include "tools/mimesis/log/drain.h"

#include <algorithm>

namespace mimesis::tool {

void Drain::received(WallTime now, bool graph_time, std::uint64_t time_ns) {
  // Nobody says where simulated time was at the signal: what comes right behind it is counted in.
  if (graph_time && now - begin_ < kQuiet) graph_ns_ = std::max(graph_ns_, time_ns);
  const bool unknown = !graph_time && time_ns == 0;
  if (!unknown && time_ns <= (graph_time ? graph_ns_ : wall_ns_)) last_old_ = now;
}

bool Drain::over(WallTime now) const {
  return now - last_old_ >= kQuiet || now - begin_ >= kAtMost;
}

}  // namespace mimesis::tool
