#include "tools/mimesis/launch/supervisor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/machine_time.h"
#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "common/time.h"
#include "tools/mimesis/launch/hosts.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/launch/subreaper.h"
#include "tools/mimesis/table.h"

namespace mimesis::launch {
namespace {

using Clock = std::chrono::steady_clock;
using Kind = HostEvent::Kind;

constexpr std::chrono::milliseconds kHurry{500};  ///< time to stop after a second Ctrl-C

/// Says that a limit counted the time of a quiet machine; empty if the machine was one.
std::string busy(nanoseconds passed, nanoseconds limit) {
  if (passed < 1.5 * limit) return {};
  return fmt::format(" of a quiet machine: {:.0f} s passed, the machine is too slow",
                     to_seconds(passed));
}

constexpr std::size_t kMaxFile = std::size_t{64} << 20;
constexpr std::size_t kMostShown = 500;  // lines a second

void write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = write(fd, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

/// "info: ready" of a node's log line "[20:29:56.316] [vision] info: ready"; empty for other lines.
std::string_view log_words(std::string_view line) {
  constexpr std::size_t kTime = 13;  // "[20:29:56.316"
  if (!line.starts_with('[') || line.size() < kTime || line.substr(kTime, 3) != "] [") return {};
  const std::size_t end = line.find("] ", kTime + 3);
  return end == std::string_view::npos ? std::string_view() : line.substr(end + 2);
}

/// Copies the lines of a node to a file, which ends at 64 MiB, and with the node's name in front to
/// our standard error: all of them, or none, or those that are no information of its log, at most
/// 500 a second: who prints more would wait for the terminal. Writes that fail are given up
/// silently: a full disk or a closed terminal must not stop the robot's launcher.
class LineLog {
 public:
  enum class Shown { all, no_information, none };

  /// @throws std::runtime_error if the file cannot be opened.
  LineLog(const std::string& name, const std::string& file, Shown shown);
  ~LineLog() { tell_held(); }
  LineLog(const LineLog&) = delete;
  LineLog& operator=(const LineLog&) = delete;

  void take(const std::string& text, bool error);
  /// The last line on standard error that is no information of a node's log, empty before there is
  /// one: often the reason why a node ended.
  const std::string& last_error() const { return last_error_; }

 private:
  void show(std::string_view text);
  bool too_many();
  void tell_held();

  std::string prefix_;
  Shown shown_;
  Fd file_;
  std::size_t written_ = 0;
  std::chrono::steady_clock::time_point second_{};  ///< its end
  std::size_t shown_in_second_ = 0, held_ = 0;
  std::string last_error_;
};

LineLog::LineLog(const std::string& name, const std::string& file, Shown shown)
    : prefix_("[" + name + "] "),
      shown_(shown),
      file_(open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600)) {
  if (!file_.open()) throw std::runtime_error(file + ": " + std::strerror(errno));
}

void LineLog::take(const std::string& text, bool error) {
  if (error && text.find("] info: ") == std::string::npos) last_error_ = text;
  show(text);
  if (written_ > kMaxFile) return;
  written_ += text.size() + 1;
  write_all(file_.get(), text + "\n");
  if (written_ > kMaxFile) write_all(file_.get(), "(64 MiB written: the rest is not kept)\n");
}

bool LineLog::too_many() {
  if (const auto now = std::chrono::steady_clock::now(); now >= second_) {
    tell_held();
    second_ = now + std::chrono::seconds(1);
    shown_in_second_ = 0;
  }
  if (++shown_in_second_ <= kMostShown) return false;
  ++held_;
  return true;
}

void LineLog::tell_held() {
  if (held_ == 0) return;
  status_line().clear();
  write_all(STDERR_FILENO, prefix_ + "(" + std::to_string(std::exchange(held_, 0)) +
                               " lines more: see its .log)\n");
}

void LineLog::show(std::string_view text) {
  const std::string_view words = log_words(text);
  const bool information = words.starts_with("info: ") || words.starts_with("debug: ");
  if (shown_ == Shown::none || (information && shown_ != Shown::all) || too_many()) return;
  status_line().clear();
  // The name stands in front already.
  const std::string time = words.empty() ? "" : std::string(text.substr(1, 12)) + " ";
  write_all(STDERR_FILENO, prefix_ + time + printable(words.empty() ? text : words, "\t") + "\n");
}

/// One node of a run: its process, its output, and where it stands.
struct ManagedNode {
  enum class State {
    waiting,   ///< for those it comes after
    starting,  ///< runs, is not ready
    ready,
    delayed,   ///< failed, will be started again at `due`
    stopping,  ///< was asked to stop, will be killed at `due`
    ended,
  };

  ManagedNode(const NodeSpec& node, Start start, NodeHost& where, const std::string& log_file,
              bool verbose)
      : spec(node),
        plan(std::move(start)),
        host(where),
        log(name(), log_file,
            verbose          ? LineLog::Shown::all
            : node.records() ? LineLog::Shown::none  // a failure is reported at the end
                             : LineLog::Shown::no_information),
        backoff(spec.restart) {}

  void start(WallTime now) {
    host.start(name(), plan);
    running = true;
    if (state == State::delayed) ++restarts;
    ending.reset();
    silence = unheard = {};
    started = now;
    starting = {};
    state = State::starting;
    if (spec.ready_when_started) set_ready();
  }
  void set_ready() {
    state = State::ready;
    was_ready = true;
    unheard = silence;
  }
  /// Asks it to stop; `due` is `timeout` later.
  void stop(WallTime now, nanoseconds timeout) {
    host.send(name(), spec.stop.signal);
    state = State::stopping;
    due = now + timeout;
  }
  void kill() {
    host.send(name(), SIGKILL);
    killed = true;
  }
  /// Decides what follows an ending: `delayed` or `ended`.
  void ended(const Ending& how, WallTime now) {
    const bool by_itself = state == State::starting || state == State::ready;
    ending = how;
    running = false;
    state = State::ended;
    if (!by_itself || how.good()) return;
    if (const auto again = backoff.next(now)) {
      state = State::delayed;
      due = *again;
    }
  }
  bool alive() const { return running; }
  const std::string& name() const { return spec.name.text; }

  const NodeSpec spec;
  const Start plan;
  NodeHost& host;
  LineLog log;
  Backoff backoff;
  State state = State::waiting;
  WallTime due{}, started{};  ///< due: of starting, delayed and stopping
  bool running = false, was_ready = false, killed = false, named_silent = false;
  int restarts = 0;
  std::optional<Ending> ending;
  nanoseconds silence{};  ///< time without a sign of life, if it is long
  MachineTime starting;   ///< since its start
  nanoseconds unheard{};  ///< of it, before it was ready: nobody's business
};

using State = ManagedNode::State;

/// Starts the nodes of a graph, watches them, stops them in reverse.
class Supervisor {
 public:
  Supervisor(const GraphFile& graph, const Run& run, int end_fd, Fd life, News news)
      : life_(std::move(life)),
        news_(std::move(news)),
        timeout_s_(run.timeout_s),
        groups_(stop_order(graph)),
        end_(end_fd),
        directory_(runtime::graph_directory(run.graph)),
        // A run before this one may have been killed.
        registry_((clean_folder(directory_), directory_), true),
        hosts_(graph, run, directory_) {
    for (const NodeSpec& spec : graph.nodes) {
      nodes_.push_back(
          std::make_unique<ManagedNode>(spec, start_of(graph, spec, run), hosts_.of(spec),
                                        run.log + "/" + spec.name.text + ".log", run.verbose));
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
      for (const HostEvent& event : hosts_.poll()) follow(event);
      follow_registry();
      if (const std::string why = hosts_.failure(); !why.empty()) end_run(2, why);
      // A full pipe has what the subreaper needs.
      if (write(life_.get(), "", 1) < 0 && errno != EAGAIN) life_.reset();
      follow_clock(Clock::now());
      show_progress(Clock::now());
    }
    status_line().clear();
    hosts_.disconnect();
    if (const int left = end_descendants(0); left > 0)
      say("ended {} processes that nodes had left", left);
    for (const auto& node : nodes_) {
      const Ending ending = node->ending.value_or(Ending{});
      outcome_.nodes.push_back({node->name(),
                                ending.signal != 0 ? 128 + ending.signal : ending.code,
                                node->restarts, node->killed});
      if (node->spec.records()) judge_log(*node, ending);
      // It hung before: nobody knows since when, so what it was needed for has not been done.
      if (node->spec.required && node->killed && outcome_.exit_code == 0) {
        outcome_.exit_code = 1;
        outcome_.reason = fmt::format("node '{}' did not stop in time", node->name());
      }
    }
    clean_folder(directory_);
    life_.reset();  // nothing is left that needs us
    return outcome_;
  }

 private:
  bool is_ready(const std::string& name) const {
    for (const auto& node : nodes_) {
      if (node->name() == name) return node->was_ready;
    }
    return true;
  }

  /// A node that has not started waits for this one to become ready.
  bool awaited(const ManagedNode& node) const {
    for (const auto& other : nodes_) {
      if (other->state != State::waiting) continue;
      for (const Text& before : other->spec.after) {
        if (before.text == node.name()) return true;
      }
    }
    return false;
  }

  void start_what_can() {
    awaits_host_ = false;
    for (auto& node : nodes_) {
      bool due = node->state == State::delayed && node->due <= Clock::now();
      if (node->state == State::waiting) {
        due = true;
        for (const Text& before : node->spec.after) due = due && is_ready(before.text);
      }
      if (!due || stopping_) continue;
      if (hosts_.ready(node->spec)) {
        node->start(Clock::now());
      } else {
        awaits_host_ = true;
      }
    }
  }

  /// Nodes of the run that do not understand each other: a lock-step would wait at every message.
  void compare_types(const v1::NodeInfo& changed) {
    const auto ours = [this](const v1::NodeInfo& info) {
      return std::ranges::any_of(nodes_,
                                 [&](const auto& node) { return hosts_.runs(node->spec, info); });
    };
    if (!ours(changed)) return;
    for (const auto& [name, other] : registry_.nodes()) {
      const auto lines = runtime::type_mismatches(other, changed);
      if (!lines.empty() && ours(other)) return end_run(2, lines.front());
    }
  }

  void follow_registry() {
    const auto news = registry_.poll();
    hosts_.tell(news);
    for (const auto& [info, alive] : news) {
      if (alive) compare_types(info);
    }
    for (auto& node : nodes_) {
      if (node->state != State::starting) continue;
      const bool ready = std::ranges::any_of(registry_.nodes(), [&](const auto& entry) {
        return entry.second.ready() && hosts_.runs(node->spec, entry.second);
      });
      if (!ready) continue;
      node->set_ready();
      say("{} is ready ({:.2f} s)", node->name(), to_seconds(Clock::now() - node->started));
    }
  }

  void follow(const HostEvent& event) {
    const auto found =
        std::ranges::find(nodes_, event.node, [](const auto& n) { return n->name(); });
    if (found == nodes_.end()) return;
    ManagedNode& node = **found;
    switch (event.kind) {
      case Kind::output:
      case Kind::error:
        return node.log.take(event.text, event.kind == Kind::error);
      case Kind::silent:
        node.silence = event.time;
        return follow_silence(node, event.text);
      case Kind::heard:
        if (std::exchange(node.named_silent, false))
          say("{} goes on after {:.1f} s", node.name(), to_seconds(event.time - node.unheard));
        node.silence = node.unheard = {};
        return;
      case Kind::failed:
        node.running = false;
        node.state = State::ended;
        return end_run(1, fmt::format("node '{}' cannot be started: {}", node.name(), event.text));
      case Kind::refused:
        return end_run(1, fmt::format("node '{}': {}", node.name(), event.text));
      case Kind::ended:
        node.ended(event.ending, Clock::now());
        if (!stopping_) return failed(node, event.ending);
        node.state = State::ended;
        if (!event.ending.good()) say("{} {}", node.name(), event.ending.text());
    }
  }

  /// A run without its whole log has failed. A recorder that was started again has begun anew.
  void judge_log(const ManagedNode& recorder, const Ending& ending) {
    if (ending.good() && recorder.restarts == 0) return;
    std::string what = fmt::format("the log is not whole: node '{}' ", recorder.name());
    what += ending.good() ? "was started again" : ending.text();
    if (ending.signal == 0 && !ending.good()) what += ": " + recorder.log.last_error();
    say("{}", what);
    if (outcome_.exit_code > 0 && outcome_.exit_code < 128)
      return;  // it failed before: that is why
    outcome_.reason += (outcome_.reason.empty() ? "" : "; ") + what;
    if (outcome_.exit_code == 0) outcome_.exit_code = ending.good() ? 1 : ending.exit_code();
  }

  /// A node has ended by itself.
  void failed(ManagedNode& node, const Ending& ending) {
    if (node.state == State::delayed) {
      say("{} {}; starting it again in {:.2f} s", node.name(), ending.text(),
          to_seconds(node.due - Clock::now()));
      return;
    }
    const std::string what = fmt::format("node '{}' {}", node.name(), ending.text());
    // The last output of a node that could not start is the reason.
    const std::string why =
        node.was_ready || node.log.last_error().empty() ? "" : ": " + node.log.last_error();
    if (node.spec.required) {
      end_run(ending.exit_code(), what + why);
    } else if (!node.was_ready && awaited(node)) {
      end_run(ending.good() ? 1 : ending.exit_code(), what + " before it was ready" + why);
    } else {
      say("{}", what);
    }
  }

  void follow_silence(ManagedNode& node, const std::string& does) {
    const nanoseconds silence = node.silence - node.unheard;
    if (node.state != State::ready || silence < Watchdog::kNamed) return;
    const std::string how = fmt::format("{:.1f} s ({})", to_seconds(silence), does);
    if (!std::exchange(node.named_silent, true)) {
      if (does != Activity{.state = 'R'}.text()) {
        say("{} hangs: no sign of life for {}", node.name(), how);
      } else if (node.spec.hung_after > nanoseconds(0)) {
        say("{} computes one step for {:.1f} s so far, {:g} s are allowed", node.name(),
            to_seconds(silence), to_seconds(node.spec.hung_after));
      } else {
        say("{} computes one step for {:.1f} s so far", node.name(), to_seconds(silence));
      }
    }
    if (node.spec.hung_after == nanoseconds(0) || silence < node.spec.hung_after) return;
    if (node.spec.required) {
      end_run(1, fmt::format("node '{}' hung for {}", node.name(), how));
    } else if (node.spec.restart.on_failure && !node.killed) {
      node.host.send(node.name(), SIGKILL);  // its ending starts it again
    }
  }

  void follow_clock(WallTime now) {
    if (timeout_s_ > 0.0 && to_seconds(now - started_) > timeout_s_)
      end_run(3, fmt::format("--timeout: the run had {:g} s", timeout_s_));
    bool any = awaits_host_;
    for (auto& node : nodes_) {
      any = any || (node->state != State::ended && node->state != State::waiting);
      if (node->state == State::starting && (node->spec.required || awaited(*node)) &&
          node->starting.passed() >= node->spec.ready_within) {
        end_run(1, fmt::format("node '{}' was not ready within {:g} s{}", node->name(),
                               to_seconds(node->spec.ready_within),
                               busy(now - node->started, node->spec.ready_within)));
      }
      if (node->state == State::stopping && node->due <= now && node->alive() && !node->killed) {
        say("{} did not stop in time: killed", node->name());
        node->kill();
      }
    }
    if (!any && !stopping_) end_by_itself();
  }

  /// Nothing runs and nothing will.
  void end_by_itself() {
    for (const auto& node : nodes_) {
      if (const Ending ending = node->ending.value_or(Ending{}); !ending.good())
        return end_run(ending.exit_code(), fmt::format("no node is left, and node '{}' {}",
                                                       node->name(), ending.text()));
    }
    end_run(0, "");
  }

  void end_run(int code, const std::string& why) {
    if (stopping_) return;
    stopping_ = true;
    outcome_.exit_code = code;
    outcome_.reason = why;
    if (!why.empty()) say("{}: stopping", why);
    for (auto& node : nodes_) {
      if (!node->alive()) node->state = State::ended;
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
          if (node->state == State::stopping) continue;
          const nanoseconds timeout = node->spec.stop.timeout;
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
        if (interrupts_ == 2) node->due = std::min(node->due, Clock::now() + kHurry);
        if (interrupts_ > 2 && node->alive()) node->kill();
      }
    }
  }

  WallTime next_due(WallTime now) const {
    WallTime next = now + std::min<nanoseconds>(registry_.patience(), kLook);
    for (const auto& node : nodes_) {
      const bool timed = node->state == State::delayed || node->state == State::starting ||
                         (node->state == State::stopping && !node->killed);
      if (timed && node->due > now) next = std::min(next, node->due);
    }
    return next;
  }

  void show_progress(WallTime now) {
    std::size_t ready = 0, running = 0;
    for (const auto& node : nodes_) {
      ready += node->state == State::ready ? 1 : 0;
      running += node->alive() ? 1 : 0;
    }
    const std::string news = news_ ? news_() : "";
    status_line().show(
        stopping_ ? fmt::format("stopping: {} nodes run", running)
                  : fmt::format("{:.0f} s: {} of {} nodes ready{}{}", to_seconds(now - started_),
                                ready, nodes_.size(), news.empty() ? "" : ", ", news),
        now);
  }

  void sleep() {
    std::vector<pollfd> fds = {{signals_.get(), POLLIN, 0},
                               {registry_.fd(), POLLIN, 0},
                               {end_ >= 0 && !stopping_ ? end_ : -1, POLLIN, 0}};
    hosts_.watch(fds);
    const auto now = Clock::now();
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_due(now) - now);
    poll(fds.data(), fds.size(), static_cast<int>(std::clamp<long>(wait.count(), 0, 60'000)));
    if ((fds[2].revents & POLLIN) != 0) end_run(0, "");
  }

  Fd life_;  ///< to the subreaper
  News news_;
  const WallTime started_ = Clock::now();
  double timeout_s_;  ///< of the run; 0: none
  std::vector<std::vector<std::string>> groups_;
  int end_;                ///< readable when the run shall end; -1: none
  std::string directory_;  ///< of the graph
  runtime::Registry registry_;
  Hosts hosts_;
  std::vector<std::unique_ptr<ManagedNode>> nodes_;
  Fd signals_ = open_signals();
  Outcome outcome_;
  bool stopping_ = false, done_ = false;
  bool awaits_host_ = false;  ///< a node could start if its host were there
  std::size_t group_ = 0;     ///< index in `groups_` of the group being stopped
  int interrupts_ = 0;
};

}  // namespace

std::optional<WallTime> Backoff::next(WallTime now) {
  if (!restart_.on_failure) return std::nullopt;
  while (!restarts_.empty() && now - restarts_.front() > restart_.window) restarts_.pop_front();
  if (restarts_.size() >= static_cast<std::size_t>(restart_.max)) return std::nullopt;
  const double factor = std::pow(restart_.backoff, static_cast<double>(restarts_.size()));
  const auto delay = std::chrono::duration<double, std::nano>(
      static_cast<double>(restart_.delay.count()) * factor);
  // A longer pause than the window makes no sense: the count has started again by then.
  const nanoseconds bounded = delay < restart_.window
                                  ? std::chrono::duration_cast<nanoseconds>(delay)
                                  : std::max(restart_.window, restart_.delay);
  restarts_.push_back(now);
  return now + bounded;
}

Outcome supervise(const GraphFile& graph, const Run& run, int end_fd, Fd life, News news) {
  return Supervisor(graph, run, end_fd, std::move(life), std::move(news)).run();
}

}  // namespace mimesis::launch
