#include "tools/mimesis/machine_state.h"

#include <fmt/format.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <thread>
#include <vector>

namespace mimesis::tool {

MachineState measure_machine(std::chrono::milliseconds duration) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kPeriod{1};
  MachineState state;
  std::ifstream("/proc/loadavg") >> state.load;
  state.processors = std::max(1L, sysconf(_SC_NPROCESSORS_ONLN));
  const int slack = prctl(PR_GET_TIMERSLACK);
  prctl(PR_SET_TIMERSLACK, 1000UL);
  std::vector<double> late;
  const auto end = Clock::now() + duration;
  for (auto due = Clock::now() + kPeriod; due < end; due = std::max(due, Clock::now()) + kPeriod) {
    std::this_thread::sleep_until(due);
    late.push_back(std::chrono::duration<double>(Clock::now() - due).count());
  }
  prctl(PR_SET_TIMERSLACK, static_cast<unsigned long>(slack));
  if (late.empty()) return state;
  std::ranges::sort(late);
  state.late_p99_s = late[(late.size() - 1) * 99 / 100];
  state.late_worst_s = late.back();
  return state;
}

bool MachineState::busy() const {
  return late_p99_s > 5e-3 || load > 1.5 * static_cast<double>(processors);
}

std::string MachineState::text() const {
  return fmt::format(
      "load {:.1f} on {} processors, wake-ups {:.1f} ms late (99 %), {:.1f} ms (most)", load,
      processors, late_p99_s * 1e3, late_worst_s * 1e3);
}

}  // namespace mimesis::tool
