#include "common/machine_time.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <thread>

namespace mimesis {
namespace {

constexpr double kLeastShare = 0.02;

/// Tasks that run or wait for a processor, with the caller; 1 if the kernel does not say.
int runnable_tasks() {
  std::array<char, 128> text{};
  const int fd = open("/proc/loadavg", O_RDONLY | O_CLOEXEC);
  if (fd < 0) return 1;
  const ssize_t n = read(fd, text.data(), text.size() - 1);
  close(fd);
  int running = 1;
  if (n <= 0 || std::sscanf(text.data(), "%*s %*s %*s %d/", &running) != 1) return 1;
  return running;
}

}  // namespace

double processor_share() {
  static const double processors = std::max(1u, std::thread::hardware_concurrency());
  return std::clamp(processors / std::max(1, runnable_tasks()), kLeastShare, 1.0);
}

std::chrono::nanoseconds MachineTime::passed() {
  const auto now = std::chrono::steady_clock::now();
  const std::chrono::duration<double, std::nano> since = now - looked_;
  looked_ = now;
  passed_ += std::chrono::nanoseconds(static_cast<std::int64_t>(since.count() * processor_share()));
  return passed_;
}

}  // namespace mimesis
