#include "hw/outside/stop_inputs.h"

#include <csignal>
#include <utility>

namespace mimesis::hw::outside {
namespace {

constexpr std::string_view kStop = "stop";
constexpr std::chrono::milliseconds kTimeout(50), kTimeoutLockstep(2000);

volatile std::sig_atomic_t stop_signalled = 0;

void on_stop_signal(int) { stop_signalled = 1; }

}  // namespace

StopInputs::StopInputs(const std::string& address, int unit, int input, runtime::Bus& graph)
    : graph_(graph) {
  const bool live = !graph.outside().replaying();
  if (live) {
    struct sigaction action {};
    action.sa_handler = on_stop_signal;
    action.sa_flags = SA_RESTART;
    sigaction(SIGUSR1, &action, nullptr);
  }
  if (address.empty()) return;
  const modbus::Address server = modbus::parse_address(address, graph.directory());
  graph.outside().opens(kStop, address);
  const bool threaded = !graph.lockstep();
  if (live) {
    circuit_ = std::make_unique<modbus::StopInput>(server, unit, input, threaded,
                                                   threaded ? kTimeout : kTimeoutLockstep);
  }
}

StopInputs::~StopInputs() = default;

std::string StopInputs::demanded() {
  return runtime::read_outside(graph_, kStop, [this]() -> std::string {
    if (std::exchange(stop_signalled, 0) != 0) return "signal SIGUSR1";
    return circuit_ ? circuit_->open() : "";
  });
}

}  // namespace mimesis::hw::outside
