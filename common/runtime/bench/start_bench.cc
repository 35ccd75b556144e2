// Processes that all publish and all hear each other: from the first fork until each has heard a
// message of every other one, beside gz-transport 11 with the same processes and rates (2 ms).
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>
#include <vector>

#include "common/testing/process.h"

namespace mimesis::runtime {
namespace {

/// Standard output of all members is one pipe.
class Members {
 public:
  Members(const char* program, const std::string& graph, int count) {
    if (pipe2(pipe_.data(), O_CLOEXEC) != 0) return;
    for (int i = 0; i < count; ++i) {
      const std::string own = std::to_string(i), all = std::to_string(count);
      const pid_t pid = fork();
      if (pid == 0) {
        dup2(pipe_[1], STDOUT_FILENO);
        execl(program, program, graph.c_str(), own.c_str(), all.c_str(), nullptr);
        _exit(127);
      }
      pids_.push_back(pid);
    }
  }
  ~Members() {
    for (const pid_t pid : pids_) kill(pid, SIGKILL);
    for (const pid_t pid : pids_) waitpid(pid, nullptr, 0);
    for (const int fd : pipe_) close(fd);
  }
  Members(const Members&) = delete;
  Members& operator=(const Members&) = delete;

  /// Until each has heard all others; false after 20 s without news.
  bool wait() {
    for (std::size_t done = 0; done < pids_.size();) {
      pollfd one{.fd = pipe_[0], .events = POLLIN, .revents = 0};
      std::array<char, 64> bytes;
      if (poll(&one, 1, 20'000) <= 0) return false;
      done +=
          static_cast<std::size_t>(std::max<ssize_t>(0, read(one.fd, bytes.data(), bytes.size())));
    }
    return true;
  }

 private:
  std::array<int, 2> pipe_{-1, -1};
  std::vector<pid_t> pids_;
};

void connect(benchmark::State& state, const char* program) {
  setenv("IGN_IP", "127.0.0.1", 1);
  for ([[maybe_unused]] auto _ : state) {
    const testing::TestGraph graph;
    auto members =
        std::make_unique<Members>(program, graph.name(), static_cast<int>(state.range(0)));
    if (!members->wait()) return state.SkipWithError("not all have heard all others");
    state.PauseTiming();
    members.reset();
    state.ResumeTiming();
  }
}

#ifdef MIMESIS_GZ_MEMBER
BENCHMARK_CAPTURE(connect, peer / gz_transport, MIMESIS_GZ_MEMBER)
    ->Arg(10)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
#endif
BENCHMARK_CAPTURE(connect, ours, MIMESIS_MEMBER)
    ->Arg(10)
    ->Arg(30)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace mimesis::runtime
