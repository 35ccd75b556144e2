#include "tools/mimesis/launch/supervisor.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cstdio>
#include <stdexcept>

#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "tools/mimesis/launch/keeper.h"
#include "tools/mimesis/launch/managed_node.h"
#include "tools/mimesis/launch/order.h"

namespace mimesis::launch {
namespace {

using State = ManagedNode::State;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kHurry{500};  ///< time to stop after a second Ctrl-C

template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) {
  const std::string line = fmt::format(format, std::forward<Args>(args)...);
  std::fprintf(stderr, "mimesis: %s\n", line.c_str());
}

double seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

Fd open_signals() {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&set, s);
  Fd fd(signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!fd.open()) throw std::runtime_error("signalfd failed");
  return fd;
}

}  // namespace

struct Supervisor::Impl {
  Impl(const GraphFile& graph, const Run& run, RunEnd* run_end)
      : groups(stop_order(graph)), end(run_end), registry(runtime::graph_directory(run.graph)) {
    for (const NodeSpec& spec : graph.nodes) {
      nodes.push_back(std::make_unique<ManagedNode>(spec, command(graph, spec, run),
                                                    run.log + "/" + spec.name.text + ".log"));
    }
  }

  Outcome run();

  // Running
  void start_what_can();
  void follow_registry();
  void follow_endings();
  void follow_clock(WallTime now);
  void failed(ManagedNode& node, const Ending& ending);
  bool awaited(const ManagedNode& node) const;
  bool is_ready(const std::string& name) const;
  // Stopping
  void end_run(int code, const std::string& why);
  void stop_group(WallTime now);
  void signalled();
  // Waiting
  void sleep();
  WallTime next_due(WallTime now) const;

  std::vector<std::unique_ptr<ManagedNode>> nodes;
  std::vector<std::vector<std::string>> groups;
  RunEnd* end;
  runtime::Registry registry;
  Fd signals = open_signals();
  Outcome outcome;
  bool stopping = false, done = false;
  std::size_t group = 0;  ///< of `groups`, being stopped
  int interrupts = 0;
};

bool Supervisor::Impl::is_ready(const std::string& name) const {
  for (const auto& node : nodes) {
    if (node->name() == name) return node->was_ready();
  }
  return true;
}

/// Somebody waits for this node to become ready.
bool Supervisor::Impl::awaited(const ManagedNode& node) const {
  for (const auto& other : nodes) {
    if (other->state() != State::waiting) continue;
    for (const Text& before : other->spec().after) {
      if (before.text == node.name()) return true;
    }
  }
  return false;
}

void Supervisor::Impl::start_what_can() {
  for (auto& node : nodes) {
    bool due = node->state() == State::delayed && node->due() <= Clock::now();
    if (node->state() == State::waiting) {
      due = true;
      for (const Text& before : node->spec().after) due = due && is_ready(before.text);
    }
    if (!due || stopping) continue;
    try {
      node->start(Clock::now());
    } catch (const std::runtime_error& e) {
      node->give_up();
      end_run(1, fmt::format("node '{}' cannot be started: {}", node->name(), e.what()));
    }
  }
}

void Supervisor::Impl::follow_registry() {
  registry.poll();
  for (const auto& [name, info] : registry.nodes()) {
    for (auto& node : nodes) {
      // By pid: the name a program has in the graph may differ from the one in the file (recorder).
      const bool same = node->spec().host ? name == node->name()
                                          : static_cast<pid_t>(info.pid()) == node->child().pid;
      if (!same || !info.ready() || node->state() != State::starting) continue;
      node->set_ready();
      say("{} is ready ({:.2f} s)", node->name(), seconds(Clock::now() - node->started()));
    }
  }
}

void Supervisor::Impl::follow_endings() {
  for (auto& node : nodes) {
    const auto ending = node->poll();
    if (!ending) continue;
    node->ended(*ending, Clock::now());
    if (stopping) {
      node->give_up();
      if (!ending->good()) say("{} {}", node->name(), ending->text());
    } else {
      failed(*node, *ending);
    }
  }
}

/// A node has ended by itself.
void Supervisor::Impl::failed(ManagedNode& node, const Ending& ending) {
  if (node.state() == State::delayed) {
    say("{} {}; starting it again in {:.2f} s", node.name(), ending.text(),
        seconds(node.due() - Clock::now()));
    return;
  }
  const std::string what = fmt::format("node '{}' {}", node.name(), ending.text());
  // Who could not begin says why last.
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

void Supervisor::Impl::follow_clock(WallTime now) {
  bool any = false;
  for (auto& node : nodes) {
    any = any || (node->state() != State::ended && node->state() != State::waiting);
    if (node->state() == State::starting && node->due() <= now &&
        (node->spec().required || awaited(*node))) {
      end_run(1, fmt::format("node '{}' was not ready within {:g} s", node->name(),
                             seconds(node->spec().ready_within)));
    }
    if (node->state() == State::stopping && node->due() <= now && node->alive() &&
        !node->killed()) {
      say("{} did not stop in time: killed", node->name());
      node->kill();
    }
  }
  if (!any && !stopping) end_run(0, "");  // nothing runs and nothing will
}

void Supervisor::Impl::end_run(int code, const std::string& why) {
  if (stopping) return;
  stopping = true;
  outcome.exit_code = code;
  outcome.reason = why;
  if (!why.empty()) say("{}: stopping", why);
  for (auto& node : nodes) {
    if (!node->alive()) node->give_up();
  }
}

/// Asks the current group to stop; goes on to the next when all of it has ended.
void Supervisor::Impl::stop_group(WallTime now) {
  while (!done) {
    bool alive = false;
    for (const std::string& name : groups[group]) {
      for (auto& node : nodes) {
        if (node->name() != name || !node->alive()) continue;
        alive = true;
        if (node->state() == State::stopping) continue;
        const nanoseconds timeout = node->spec().stop.timeout;
        node->stop(now, interrupts > 1 ? std::min<nanoseconds>(timeout, kHurry) : timeout);
      }
    }
    if (alive) return;
    done = ++group >= groups.size();
  }
}

void Supervisor::Impl::signalled() {
  signalfd_siginfo info{};
  while (read(signals.get(), &info, sizeof info) == sizeof info) {
    const int number = static_cast<int>(info.ssi_signo);
    ++interrupts;
    if (interrupts == 1)
      end_run(128 + number, fmt::format("interrupted by SIG{}", sigabbrev_np(number)));
    for (auto& node : nodes) {
      if (interrupts == 2) node->hurry(Clock::now() + kHurry);
      if (interrupts > 2 && node->alive()) node->kill();
    }
  }
}

WallTime Supervisor::Impl::next_due(WallTime now) const {
  WallTime next = now + registry.patience();
  for (const auto& node : nodes) {
    const bool timed = node->state() == State::delayed || node->state() == State::starting ||
                       (node->state() == State::stopping && !node->killed());
    if (timed && node->due() > now) next = std::min(next, node->due());
  }
  return next;
}

void Supervisor::Impl::sleep() {
  std::vector<pollfd> fds = {{signals.get(), POLLIN, 0}, {registry.fd(), POLLIN, 0}};
  if (end != nullptr && !stopping) fds.push_back({end->fd(), POLLIN, 0});
  for (const auto& node : nodes) {
    const Child& child = node->child();
    for (const Fd* fd : {&child.pidfd, &child.out, &child.err}) {
      if (fd->open()) fds.push_back({fd->get(), POLLIN, 0});
    }
  }
  const auto now = Clock::now();
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_due(now) - now);
  poll(fds.data(), fds.size(), static_cast<int>(std::clamp<long>(wait.count(), 0, 60'000)));
  if (end != nullptr && !stopping && (fds[2].revents & POLLIN) != 0) end_run(0, "");
}

Outcome Supervisor::Impl::run() {
  while (!done) {
    start_what_can();
    if (stopping) {
      stop_group(Clock::now());
      if (done) break;
    }
    sleep();
    signalled();
    follow_endings();
    follow_registry();
    follow_clock(Clock::now());
  }
  if (const int left = end_descendants(0); left > 0)
    say("ended {} processes that nodes had left", left);
  for (const auto& node : nodes) {
    const Ending ending = node->ending().value_or(Ending{});
    outcome.nodes.push_back({node->name(), ending.signal != 0 ? 128 + ending.signal : ending.code,
                             node->restarts(), node->killed()});
  }
  return outcome;
}

Supervisor::Supervisor(const GraphFile& graph, const Run& run, RunEnd* end)
    : impl_(std::make_unique<Impl>(graph, run, end)) {}

Supervisor::~Supervisor() = default;

Outcome Supervisor::run() { return impl_->run(); }

}  // namespace mimesis::launch
