#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "common/runtime/zmq_bus.h"

namespace mimesis::clock {

struct ClockParams {
  std::string mode = "lockstep";  ///< sim or lockstep
  double factor = 0.0;            ///< simulated seconds per second; 0: as fast as possible [1]
  std::vector<std::string> participants;  ///< nodes without which time does not begin
  double until_s = 0.0;                   ///< end of simulated time [s]; 0: none
  double patience_s = 120.0;  ///< a node whose step takes longer leaves the lock-step [s]

  void visit(runtime::ParamVisitor& v) {
    v("mode", mode, {"sim", "lockstep"});
    v("factor", factor, 0.0, 1000.0);
    v("participants", participants);
    v("until_s", until_s, 0.0, 1e9);
    v("patience_s", patience_s, 0.1, 1e6);
  }
};

/// The output clock/time.
runtime::Out<v1::ClockTime> time_port(runtime::Bus& bus);

/// Runs simulated time until `stop_fd` is readable or time is over.
/// Lock-step: conducts the nodes (common/runtime/conductor.h); time also goes out on clock/time.
void conduct(const ClockParams& params, runtime::ZmqBus& bus, int stop_fd);

/// Sim: publishes clock/time; the nodes run free.
/// @throws ConfigError if factor is 0: free-running nodes need a pace.
void publish_time(const ClockParams& params, runtime::ZmqBus& bus, int stop_fd);

/// The program: like runtime::run, but this node is the source of time.
int run_clock(int argc, char** argv);

}  // namespace mimesis::clock
