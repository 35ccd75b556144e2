#include "tools/mimesis/launch/supervisor.h"

#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "common/time.h"
#include "tools/mimesis/launch/graph_file.h"
#include "tools/mimesis/launch/managed_node.h"
#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {
namespace {

using State = ManagedNode::State;
using Clock = std::chrono::steady_clock;

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

/// Ends all descendants of this process that it inherited as a subreaper: SIGTERM, then SIGKILL
/// after `grace_ms`. Returns how many there were. Precondition: SIGCHLD is blocked.
int end_descendants(int grace_ms) {
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

int wait_for(pid_t worker, const sigset_t& set) {
  while (true) {
    siginfo_t info{};
    if (sigwaitinfo(&set, &info) < 0) continue;
    if (info.si_signo != SIGCHLD) {
      kill(worker, info.si_signo);
      continue;
    }
    // Only the worker is waited for: its remaining processes are ended together afterwards.
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

constexpr std::chrono::milliseconds kHurry{500};  ///< time to stop after a second Ctrl-C

template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) {
  const std::string line = fmt::format(format, std::forward<Args>(args)...);
  std::fprintf(stderr, "mimesis: %s\n", line.c_str());
}

Fd open_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set, s);
  Fd fd(signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!fd.open()) throw std::runtime_error("signalfd failed");
  return fd;
}

/// Starts the nodes of a graph, watches them, stops them in reverse.
class Supervisor {
 public:
  Supervisor(const GraphFile& graph, const Run& run, int end_fd)
      : groups_(stop_order(graph)), end_(end_fd), registry_(runtime::graph_directory(run.graph)) {
    for (const NodeSpec& spec : graph.nodes) {
      nodes_.push_back(std::make_unique<ManagedNode>(spec, command(graph, spec, run),
                                                     run.log + "/" + spec.name.text + ".log"));
    }
  }

  Outcome run() {
    while (!done_) {
      start_what_can();
      if (stopping_) {
        stop_group(Clock::now());
        if (done_) break;
      }
      sleep();
      signalled();
      follow_endings();
      follow_registry();
      follow_clock(Clock::now());
    }
    if (const int left = end_descendants(0); left > 0)
      say("ended {} processes that nodes had left", left);
    for (const auto& node : nodes_) {
      const Ending ending = node->ending().value_or(Ending{});
      outcome_.nodes.push_back({node->name(),
                                ending.signal != 0 ? 128 + ending.signal : ending.code,
                                node->restarts(), node->killed()});
    }
    return outcome_;
  }

 private:
  bool is_ready(const std::string& name) const {
    for (const auto& node : nodes_) {
      if (node->name() == name) return node->was_ready();
    }
    return true;
  }

  /// A node that has not started waits for this one to become ready.
  bool awaited(const ManagedNode& node) const {
    for (const auto& other : nodes_) {
      if (other->state() != State::waiting) continue;
      for (const Text& before : other->spec().after) {
        if (before.text == node.name()) return true;
      }
    }
    return false;
  }

  void start_what_can() {
    for (auto& node : nodes_) {
      bool due = node->state() == State::delayed && node->due() <= Clock::now();
      if (node->state() == State::waiting) {
        due = true;
        for (const Text& before : node->spec().after) due = due && is_ready(before.text);
      }
      if (!due || stopping_) continue;
      try {
        node->start(Clock::now());
      } catch (const std::runtime_error& e) {
        node->give_up();
        end_run(1, fmt::format("node '{}' cannot be started: {}", node->name(), e.what()));
      }
    }
  }

  void follow_registry() {
    registry_.poll();
    for (const auto& [name, info] : registry_.nodes()) {
      for (auto& node : nodes_) {
        // By pid: the name a program has in the graph may differ from the one in the file
        // (recorder).
        const bool same = node->spec().host ? name == node->name()
                                            : static_cast<pid_t>(info.pid()) == node->child().pid;
        if (!same || !info.ready() || node->state() != State::starting) continue;
        node->set_ready();
        say("{} is ready ({:.2f} s)", node->name(), to_seconds(Clock::now() - node->started()));
      }
    }
  }

  void follow_endings() {
    for (auto& node : nodes_) {
      const auto ending = node->poll();
      if (!ending) continue;
      node->ended(*ending, Clock::now());
      if (stopping_) {
        node->give_up();
        if (!ending->good()) say("{} {}", node->name(), ending->text());
      } else {
        failed(*node, *ending);
      }
    }
  }

  /// A node has ended by itself.
  void failed(ManagedNode& node, const Ending& ending) {
    if (node.state() == State::delayed) {
      say("{} {}; starting it again in {:.2f} s", node.name(), ending.text(),
          to_seconds(node.due() - Clock::now()));
      return;
    }
    const std::string what = fmt::format("node '{}' {}", node.name(), ending.text());
    // The last output of a node that could not start is the reason.
    const std::string why =
        node.was_ready() || node.last_error().empty() ? "" : ": " + node.last_error();
    if (node.spec().required) {
      end_run(ending.exit_code(), what + why);
    } else if (!node.was_ready() && awaited(node)) {
      end_run(ending.good() ? 1 : ending.exit_code(), what + " before it was ready" + why);
    } else {
      say("{}", what);
    }
  }

  void follow_clock(WallTime now) {
    bool any = false;
    for (auto& node : nodes_) {
      any = any || (node->state() != State::ended && node->state() != State::waiting);
      if (node->state() == State::starting && node->due() <= now &&
          (node->spec().required || awaited(*node))) {
        end_run(1, fmt::format("node '{}' was not ready within {:g} s", node->name(),
                               to_seconds(node->spec().ready_within)));
      }
      if (node->state() == State::stopping && node->due() <= now && node->alive() &&
          !node->killed()) {
        say("{} did not stop in time: killed", node->name());
        node->kill();
      }
    }
    if (!any && !stopping_) end_run(0, "");  // nothing runs and nothing will
  }

  void end_run(int code, const std::string& why) {
    if (stopping_) return;
    stopping_ = true;
    outcome_.exit_code = code;
    outcome_.reason = why;
    if (!why.empty()) say("{}: stopping", why);
    for (auto& node : nodes_) {
      if (!node->alive()) node->give_up();
    }
  }

  /// Asks the current group to stop; continues with the next when all of it has ended.
  void stop_group(WallTime now) {
    while (!done_) {
      bool alive = false;
      for (const std::string& name : groups_[group_]) {
        for (auto& node : nodes_) {
          if (node->name() != name || !node->alive()) continue;
          alive = true;
          if (node->state() == State::stopping) continue;
          const nanoseconds timeout = node->spec().stop.timeout;
          node->stop(now, interrupts_ > 1 ? std::min<nanoseconds>(timeout, kHurry) : timeout);
        }
      }
      if (alive) return;
      done_ = ++group_ >= groups_.size();
    }
  }

  void signalled() {
    signalfd_siginfo info{};
    while (read(signals_.get(), &info, sizeof info) == sizeof info) {
      const int number = static_cast<int>(info.ssi_signo);
      ++interrupts_;
      if (interrupts_ == 1)
        end_run(128 + number, fmt::format("interrupted by SIG{}", sigabbrev_np(number)));
      for (auto& node : nodes_) {
        if (interrupts_ == 2) node->hurry(Clock::now() + kHurry);
        if (interrupts_ > 2 && node->alive()) node->kill();
      }
    }
  }

  WallTime next_due(WallTime now) const {
    WallTime next = now + registry_.patience();
    for (const auto& node : nodes_) {
      const bool timed = node->state() == State::delayed || node->state() == State::starting ||
                         (node->state() == State::stopping && !node->killed());
      if (timed && node->due() > now) next = std::min(next, node->due());
    }
    return next;
  }

  void sleep() {
    std::vector<pollfd> fds = {{signals_.get(), POLLIN, 0}, {registry_.fd(), POLLIN, 0}};
    if (end_ >= 0 && !stopping_) fds.push_back({end_, POLLIN, 0});
    for (const auto& node : nodes_) {
      const Child& child = node->child();
      for (const Fd* fd : {&child.pidfd, &child.out, &child.err}) {
        if (fd->open()) fds.push_back({fd->get(), POLLIN, 0});
      }
    }
    const auto now = Clock::now();
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_due(now) - now);
    poll(fds.data(), fds.size(), static_cast<int>(std::clamp<long>(wait.count(), 0, 60'000)));
    if (end_ >= 0 && !stopping_ && (fds[2].revents & POLLIN) != 0) end_run(0, "");
  }

  std::vector<std::unique_ptr<ManagedNode>> nodes_;
  std::vector<std::vector<std::string>> groups_;
  int end_;  ///< readable when the run shall end; -1: none
  runtime::Registry registry_;
  Fd signals_ = open_signals();
  Outcome outcome_;
  bool stopping_ = false, done_ = false;
  std::size_t group_ = 0;  ///< index in `groups_` of the group being stopped
  int interrupts_ = 0;
};

}  // namespace

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

Outcome supervise(const GraphFile& graph, const Run& run, int end_fd) {
  return Supervisor(graph, run, end_fd).run();
}

}  // namespace mimesis::launch
