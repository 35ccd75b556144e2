#pragma once
#include <chrono>
#include <string>

namespace mimesis::tool {

/// How much of this machine a process gets that wakes up once a millisecond.
struct MachineState {
  double late_p99_s = 0.0, late_worst_s = 0.0;  ///< wake-ups behind their time
  double load = 0.0;                            ///< tasks that want to run, mean of a minute
  long processors = 1;

  /// It wakes processes later than a cycle of our fastest robots (5 ms), or has 1.5 times as many
  /// tasks as processors: graphs on the wall clock miss cycles.
  bool busy() const;
  std::string text()
      const;  ///< "load 0.4 on 2 processors, wake-ups 0.1 ms late (99 %), 0.3 ms (most)"
};
MachineState measure_machine(std::chrono::milliseconds duration);

}  // namespace mimesis::tool
