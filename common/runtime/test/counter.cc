#include <unistd.h>

#include <cmath>
#include <stdexcept>

#include "common/error.h"
#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/runtime/run_node.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

struct CounterParams {
  double rate_hz = 100.0;  ///< step rate [Hz]
  double offset_s = 0.0;   ///< time of the first step within the period [s]
  int work = 0;            ///< square roots per step: load [1]
  int fail_at_step = 0;    ///< throws in this step; 0: never [1]
  int hang_at_step = 0;    ///< this step never ends; 0: none [1]
  bool hang_busy = false;  ///< and computes meanwhile
  int salt = 0;            ///< start value of the hash [1]
  std::string mode = "mix";

  void visit(ParamVisitor& v) {
    v("rate_hz", rate_hz, 0.1, 10'000.0);
    v("offset_s", offset_s, 0.0, 10.0);
    v.changeable([&] { v("work", work, 0, 1'000'000'000); });
    v("fail_at_step", fail_at_step, 0, 1'000'000'000);
    v("hang_at_step", hang_at_step, 0, 1'000'000'000);
    v("hang_busy", hang_busy);
    v.changeable([&] { v("salt", salt, 0, 1'000'000'000); });
    v("mode", mode, {"mix", "refuse", "needs"});
  }
};

/// A node for tests: each step publishes a hash of everything it has seen so far, in order, with
/// the times at which it saw it. Equal outputs of two runs mean equal inputs in an equal order at
/// equal times.
class CounterNode {
 public:
  using Params = CounterParams;
  CounterNode(const Params& params, Bus& bus);
  void step(Time now);
  void change(const Params& params);  ///< a salt is mixed in
  void stop(Time now) noexcept;

 private:
  void mix(std::uint64_t word);

  Params params_;
  Reliable<v1::Publication> a_, b_;
  Latest<v1::Publication> latest_;
  Out<v1::Publication> out_;
  std::uint64_t steps_ = 0, hash_ = 0xcbf29ce484222325U;
};

CounterNode::CounterNode(const Params& params, Bus& bus)
    : params_(params),
      a_(bus, "a", true),
      b_(bus, "b", params.mode != "needs"),
      latest_(bus, "latest", {.author = Author::named, .optional = true}),
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
  while (steps_ == static_cast<std::uint64_t>(params_.hang_at_step)) {
    if (!params_.hang_busy) pause();
  }
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

int main(int argc, char** argv) {
  return mimesis::runtime::run_node<mimesis::runtime::CounterNode>(
      argc, argv,
      {.name = "counter", .about = "Publishes a hash of all it has received (for tests)"});
}
