#include "tools/mimesis/launch/keeper.h"

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {
namespace {

constexpr int kGraceMs = 3000;

/// Children of this process. Their parent is field 4 of /proc/PID/stat, after the name in brackets.
std::vector<pid_t> children() {
  std::vector<pid_t> all;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry.path() / "stat");
    std::string text;
    std::getline(stat, text);
    const std::size_t bracket = text.rfind(')');
    char state = 0;
    int parent = 0;
    if (bracket != std::string::npos &&
        std::sscanf(text.c_str() + bracket + 1, " %c %d", &state, &parent) == 2 &&
        parent == getpid()) {
      all.push_back(std::stoi(name));
    }
  }
  return all;
}

sigset_t signals_of_keeper() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGINT, SIGTERM, SIGHUP, SIGCHLD}) sigaddset(&set, s);
  return set;
}

int wait_for(pid_t worker, const sigset_t& set) {
  while (true) {
    siginfo_t info{};
    if (sigwaitinfo(&set, &info) < 0) continue;
    if (info.si_signo != SIGCHLD) {
      kill(worker, info.si_signo);
      continue;
    }
    // Only the worker is waited for: what it leaves behind is ended together afterwards.
    int status = 0;
    if (waitpid(worker, &status, WNOHANG) != worker) continue;
    if (WIFEXITED(status)) {
      end_descendants(0);
      return WEXITSTATUS(status);
    }
    const int left = end_descendants(kGraceMs);
    const Ending ending{.signal = WTERMSIG(status)};
    std::fprintf(stderr, "mimesis: the launcher %s; ended the %d processes it left\n",
                 ending.text().c_str(), left);
    return 1;
  }
}

}  // namespace

int end_descendants(int grace_ms) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::milliseconds(grace_ms);
  sigset_t child_signal;
  sigemptyset(&child_signal);
  sigaddset(&child_signal, SIGCHLD);
  std::set<pid_t> told;
  while (true) {
    while (waitpid(-1, nullptr, WNOHANG) > 0) {
    }
    const std::vector<pid_t> left = children();
    if (left.empty()) return static_cast<int>(told.size());
    const bool patient = Clock::now() < deadline;
    for (const pid_t pid : left) {
      if (told.insert(pid).second && patient) kill(pid, SIGTERM);
      if (!patient) kill(pid, SIGKILL);
    }
    const timespec pause{0, 20'000'000};
    sigtimedwait(&child_signal, nullptr, &pause);
  }
}

int keep(const std::function<int()>& work) {
  std::fflush(nullptr);
  const sigset_t set = signals_of_keeper();
  sigset_t before;
  sigprocmask(SIG_BLOCK, &set, &before);
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  signal(SIGPIPE, SIG_IGN);
  const pid_t keeper = getpid();
  const pid_t worker = fork();
  if (worker < 0) {
    std::perror("mimesis: fork");
    return 1;
  }
  if (worker > 0) return wait_for(worker, set);
  // A group of its own: Ctrl-C reaches the keeper alone, which passes it on once.
  setpgid(0, 0);
  signal(SIGTTOU, SIG_IGN);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  if (getppid() != keeper) return 1;
  return work();  // with the signals still blocked: the supervisor reads them from a descriptor
}

}  // namespace mimesis::launch
