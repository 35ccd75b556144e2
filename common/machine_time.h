#pragma once
#include <chrono>

namespace mimesis {

/// Share of a processor that a task gets which wants to run all the time, (0, 1]: processors of
/// this process over the tasks that are runnable on the machine now (/proc/loadavg), at least 0.02.
double processor_share();

/// Time as a quiet machine would have it. Limits of what depends on other processes (to start, to
/// answer) count it, so that a busy machine makes them later, not failures: while N tasks want to
/// run on P < N processors, a second counts P/N. Call passed() at least every 0.2 s.
class MachineTime {
 public:
  /// Since the construction. Never more than the wall time.
  std::chrono::nanoseconds passed();

 private:
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
  std::chrono::nanoseconds passed_{};
};

}  // namespace mimesis
