#include "tools/mimesis/launch/granted.h"

#include <fmt/format.h>
#include <sched.h>

#include <filesystem>
#include <fstream>
#include <set>

namespace mimesis::launch {
namespace {

namespace fs = std::filesystem;

std::string policy_text(int policy, int priority) {
  policy &= ~SCHED_RESET_ON_FORK;
  const char* name = policy == SCHED_FIFO    ? "fifo"
                     : policy == SCHED_RR    ? "rr"
                     : policy == SCHED_OTHER ? "other"
                                             : "another";
  return fmt::format("{} {}", name, priority);
}

/// "" if this thread has what it was asked for.
std::string thread_lacks(pid_t thread, const Sched& sched) {
  sched_param has{};
  const int policy = sched_getscheduler(thread);
  cpu_set_t cpus;
  if (policy < 0 || sched_getparam(thread, &has) != 0 ||
      sched_getaffinity(thread, sizeof cpus, &cpus) != 0)
    return {};  // it has ended
  if (sched.policy != "other") {
    const std::string asked = fmt::format("{} {}", sched.policy, sched.priority);
    const std::string got = policy_text(policy, has.sched_priority);
    if (got != asked) return fmt::format("policy: expected {}, the system gave {}", asked, got);
  }
  if (sched.cpus.empty()) return {};
  std::set<int> got;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<std::size_t>(cpu), &cpus)) got.insert(cpu);
  }
  const std::set<int> asked(sched.cpus.begin(), sched.cpus.end());
  return got == asked ? ""
                      : fmt::format("cpus: expected {}, the system gave {}", fmt::join(asked, ", "),
                                    fmt::join(got, ", "));
}

/// Memory that a process has locked [kB], VmLck of proc(5).
long locked_kb(pid_t pid) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmLck:")) return std::stol(line.substr(6));
  }
  return -1;  // it has ended
}

}  // namespace

std::string not_granted(pid_t pid, const Sched& sched, bool locked) {
  if (sched.policy == "other" && sched.cpus.empty() && !sched.mlock) return {};
  std::error_code gone;
  fs::directory_iterator task(fmt::format("/proc/{}/task", pid), gone);
  for (; !gone && task != fs::directory_iterator(); task.increment(gone)) {
    const pid_t thread = std::stoi(task->path().filename());
    if (const std::string lacks = thread_lacks(thread, sched); !lacks.empty()) {
      std::ifstream comm(task->path() / "comm");
      std::string name;
      std::getline(comm, name);
      return "sched." + lacks + (thread == pid ? "" : fmt::format(" (its thread '{}')", name));
    }
  }
  if (locked && sched.mlock && locked_kb(pid) == 0)
    return "sched.mlock: expected locked memory, the system says VmLck 0 kB";
  return {};
}

}  // namespace mimesis::launch
