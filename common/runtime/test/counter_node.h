#pragma once
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {

struct CounterParams {
  double rate_hz = 100.0;  ///< step rate [Hz]
  double offset_s = 0.0;   ///< time of the first step within the period [s]
  int work = 0;            ///< square roots per step: load [1]
  int fail_at_step = 0;    ///< throws in this step; 0: never [1]
  int hang_at_step = 0;    ///< this step never ends; 0: none [1]
  int salt = 0;            ///< start value of the hash [1]
  std::string mode = "mix";

  void visit(ParamVisitor& v) {
    v("rate_hz", rate_hz, 0.1, 10'000.0);
    v("offset_s", offset_s, 0.0, 10.0);
    v.changeable([&] { v("work", work, 0, 1'000'000'000); });
    v("fail_at_step", fail_at_step, 0, 1'000'000'000);
    v("hang_at_step", hang_at_step, 0, 1'000'000'000);
    v.changeable([&] { v("salt", salt, 0, 1'000'000'000); });
    v("mode", mode, {"mix", "refuse"});
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

}  // namespace mimesis::runtime
