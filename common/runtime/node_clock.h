#pragma once
#include <cstdint>
#include <memory>
#include <optional>

#include "common/runtime/zmq_bus.h"

namespace mimesis::runtime {

/// Wiring that a node on the simulated clock needs, beside its own; before the bus is constructed.
void add_clock_wiring(BusOptions& options);

/// The graph's clock for one node: decides when to step.
class NodeClock {
 public:
  virtual ~NodeClock() = default;
  /// Waits until the next step is due, serving the bus; the inputs are then fixed. Graph time of
  /// the step, or nothing if the node shall stop.
  virtual std::optional<Time> wait() = 0;
  /// Lock-step: the next step is due then, instead of at the rate. Before `done`.
  virtual void set_next(Time) {}
  /// The step is done, its messages are sent.
  virtual void done() = 0;
  virtual Time now() const = 0;
  /// Steps that ended after the next one was due.
  std::uint64_t overruns() const { return overruns_; }

 protected:
  std::uint64_t overruns_ = 0;
};

/// @param stop_fd  readable when the node shall stop
std::unique_ptr<NodeClock> make_clock(ClockKind kind, ZmqBus& bus, double rate_hz, double offset_s,
                                      int stop_fd);

}  // namespace mimesis::runtime
