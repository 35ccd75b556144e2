#include "common/runtime/test/counter_node.h"

#include <unistd.h>

#include <cmath>
#include <stdexcept>

#include "common/error.h"
#include "common/runtime/log.h"

namespace mimesis::runtime {

CounterNode::CounterNode(const Params& params, Bus& bus)
    : params_(params),
      a_(bus, "a", true),
      b_(bus, "b", true),
      latest_(bus, "latest", {.sole = true, .optional = true}),
      out_(bus, "out") {
  hash_ ^= static_cast<std::uint64_t>(params.salt);
  offer<v1::Publication, v1::Publication>(
      bus, "add_one", [](v1::Publication p) -> tl::expected<v1::Publication, Status> {
        p.set_seq(p.seq() + 1);
        return p;
      });
  bus.ports_end();
  if (params.mode == "refuse") throw ConfigError("counter.mode: refuses");
}

void CounterNode::mix(std::uint64_t word) { hash_ = (hash_ ^ word) * 0x100000001b3U; }

void CounterNode::step(Time now) {
  ++steps_;
  if (steps_ == static_cast<std::uint64_t>(params_.fail_at_step))
    throw std::runtime_error("asked to fail");
  while (steps_ == static_cast<std::uint64_t>(params_.hang_at_step)) pause();
  volatile double load = 2.0;
  for (int i = 0; i < params_.work; ++i) load = std::sqrt(load) + 1.0;
  mix(static_cast<std::uint64_t>(now.count()));
  for (Reliable<v1::Publication>* in : {&a_, &b_}) {
    while (const auto m = in->pop()) {
      mix(m->seq());
      mix(m->start_id());
    }
  }
  if (const v1::Publication* m = latest_.take()) mix(m->start_id());
  v1::Publication m;
  m.set_topic("counter");
  m.set_seq(steps_);
  m.set_start_id(hash_);
  out_.send(m, now);
}

void CounterNode::change(const Params& params) {
  if (params.salt == 13) throw ConfigError("counter.salt: 13 brings bad luck");
  if (params.salt != params_.salt) mix(static_cast<std::uint64_t>(params.salt));
  params_ = params;
}

void CounterNode::stop(Time) noexcept { info("stopped after {} steps", steps_); }

}  // namespace mimesis::runtime
