#include "tools/mimesis/launch/supervisor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "common/time.h"
#include "tools/mimesis/launch/process.h"
#include "tools/mimesis/launch/watchdog.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"

namespace mimesis::launch {
namespace {

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

sigset_t set_of(std::initializer_list<int> signals) {
  sigset_t set;
  sigemptyset(&set);
  for (const int s : signals) sigaddset(&set, s);
  return set;
}

/// Ends all descendants of this process that it inherited as a subreaper: SIGTERM, then SIGKILL
/// after `grace_ms`. Returns how many there were. Precondition: SIGCHLD is blocked.
int end_descendants(int grace_ms) {
  const auto grace = std::chrono::milliseconds(grace_ms);
  const auto start = Clock::now();
  const sigset_t child_signal = set_of({SIGCHLD});
  std::set<pid_t> seen, told;
  while (true) {
    while (waitpid(-1, nullptr, WNOHANG) > 0) {
    }
    const std::vector<pid_t> left = children();
    if (left.empty()) return static_cast<int>(seen.size());
    const auto passed = Clock::now() - start;
    for (const pid_t pid : left) {
      seen.insert(pid);
      // A node leads its session and got SIGTERM when its parent died. A second one would end it
      // before it has stopped what it moves.
      const bool due = getsid(pid) != pid || passed > grace * 2 / 3;
      if (passed < grace && due && told.insert(pid).second) kill(pid, SIGTERM);
      if (passed >= grace) kill(pid, SIGKILL);
    }
    const timespec pause{0, 20'000'000};
    sigtimedwait(&child_signal, nullptr, &pause);
  }
}

/// Of this process: other lines take it away first.
tool::StatusLine& status_line() {
  static tool::StatusLine line;
  return line;
}

template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) {
  const std::string line = fmt::format(format, std::forward<Args>(args)...);
  status_line().clear();
  std::fprintf(stderr, "mimesis: %s\n", line.c_str());
}

constexpr std::chrono::milliseconds kLook{100};  ///< period of looking for silence
constexpr std::chrono::seconds kLauncherHung{2};
/// The time since the last call. Time in which this process did not run itself is nobody's silence.
class Watched {
 public:
  nanoseconds passed(WallTime now) {
    return std::min<nanoseconds>(now - std::exchange(looked_, now), 2 * kLook);
  }

 private:
  WallTime looked_ = Clock::now();
};

int wait_for(pid_t worker, const Fd& life, const sigset_t& set,
             const std::function<void(const std::string&)>& killed) {
  Watched time;
  Silence silence;
  std::string hung;
  while (true) {
    siginfo_t info{};
    const timespec look{0, nanoseconds(kLook).count()};
    const int signal = sigtimedwait(&set, &info, &look);
    const nanoseconds passed = time.passed(Clock::now());
    std::array<char, 65536> signs;  // all that a pipe holds
    const ssize_t n = read(life.get(), signs.data(), signs.size());
    // Who reads our output may let the worker wait.
    pollfd output{STDERR_FILENO, POLLOUT, 0};
    if (n > 0 || (n < 0 && poll(&output, 1, 0) == 0)) {
      if (const auto stood = silence.heard(passed))
        say("the launcher goes on after {:.1f} s", to_seconds(*stood));
    } else if (n == 0) {
      silence = {};
    }
    if (silence.look(worker, passed))
      say("the launcher hangs: no sign of life for {}", silence.text());
    if (hung.empty() && silence.reached(kLauncherHung)) {
      hung = "the launcher hung for " + silence.text();
      kill(worker, SIGKILL);
    }
    if (signal < 0) continue;
    if (signal != SIGCHLD) {
      kill(worker, signal);
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
    const std::string why =
        hung.empty() ? "the launcher " + Ending{.signal = WTERMSIG(status)}.text() : hung;
    say("{}; ended the {} processes it left", why, left);
    killed(why);
    return 1;
  }
}

constexpr std::chrono::milliseconds kHurry{500};  ///< time to stop after a second Ctrl-C

Fd open_signals() {
  const sigset_t set = set_of({SIGINT, SIGTERM, SIGHUP});
  Fd fd(signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC));
  if (!fd.open()) throw std::runtime_error("signalfd failed");
  return fd;
}

constexpr std::size_t kMaxLine = 4096;
constexpr std::size_t kMaxFile = std::size_t{64} << 20;
constexpr int kReadsPerTurn = 16;

/// Gives up silently: a log on a full disk or a closed terminal must not stop the robot's launcher.
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

/// Copies the standard output and error of a node line by line to a file, and with the node's
/// name in front to our standard error: all of them, or none, or those that are no information of
/// its log. Bounded: a line of more than 4 KiB is broken, the file ends at 64 MiB.
class LineLog {
 public:
  enum class Shown { all, no_information, none };

  /// @throws std::runtime_error if the file cannot be opened.
  LineLog(const std::string& name, const std::string& file, Shown shown)
      : prefix_("[" + name + "] "),
        shown_(shown),
        file_(open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
    if (!file_.open()) throw std::runtime_error(file + ": " + std::strerror(errno));
  }

  /// Takes what is readable (at most 256 KiB a stream, so that others get their turn); closes
  /// streams at their end. The lines of the two do not mix.
  void pump(Child& child) {
    pump(child.out, out_);
    pump(child.err, err_);
  }
  /// Writes out a last line without its end.
  void flush() {
    for (std::string* partial : {&out_, &err_}) {
      if (!partial->empty()) take(*partial);
    }
  }
  /// The last line on standard error that is no information of a node's log, empty before there is
  /// one: often the reason why a node ended.
  const std::string& last_error() const { return last_error_; }

 private:
  void pump(Fd& from, std::string& partial) {
    std::array<char, 16384> buffer;
    for (int turn = 0; turn < kReadsPerTurn && from.open(); ++turn) {
      const ssize_t n = read(from.get(), buffer.data(), buffer.size());
      if (n < 0) return;
      if (n == 0) return from.reset();
      std::string_view bytes(buffer.data(), static_cast<std::size_t>(n));
      while (!bytes.empty()) {
        const std::size_t room = kMaxLine - partial.size();
        const std::size_t end = std::min({bytes.find('\n'), bytes.size(), room});
        partial.append(bytes.substr(0, end));
        const bool newline = end < bytes.size() && bytes[end] == '\n';
        bytes.remove_prefix(newline ? end + 1 : end);
        if (newline || partial.size() == kMaxLine) take(partial);
      }
    }
  }

  void take(std::string& partial) {
    line(partial);
    if (&partial == &err_ && partial.find("] info: ") == std::string::npos) last_error_ = partial;
    partial.clear();
  }

  void line(std::string_view text) {
    show(text);
    if (written_ > kMaxFile) return;
    written_ += text.size() + 1;
    write_all(file_.get(), std::string(text) + "\n");
    if (written_ > kMaxFile) write_all(file_.get(), "(64 MiB written: the rest is not kept)\n");
  }

  void show(std::string_view text) const {
    const std::string_view words = log_words(text);
    const bool information = words.starts_with("info: ") || words.starts_with("debug: ");
    if (shown_ == Shown::none || (information && shown_ != Shown::all)) return;
    status_line().clear();
    // The name stands in front already.
    const std::string time = words.empty() ? "" : std::string(text.substr(1, 12)) + " ";
    write_all(STDERR_FILENO, prefix_ + time + printable(words.empty() ? text : words, "\t") + "\n");
  }

  std::string prefix_;
  Shown shown_;
  Fd file_;
  std::size_t written_ = 0;
  std::string out_, err_;  ///< begun lines
  std::string last_error_;
};

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

  ManagedNode(const NodeSpec& node, Command how, const std::string& log_file, bool verbose)
      : spec(node),
        command(std::move(how)),
        log(name(), log_file,
            verbose          ? LineLog::Shown::all
            : node.records() ? LineLog::Shown::none  // a failure is reported at the end
                             : LineLog::Shown::no_information),
        backoff(spec.restart) {}

  /// @throws std::runtime_error if it cannot be started.
  void start(WallTime now) {
    child = spawn(command, spec.sched);
    if (state == State::delayed) ++restarts;
    ending.reset();
    silence = {};
    started = now;
    due = now + spec.ready_within;
    state = State::starting;
    if (spec.ready_when_started) set_ready();
  }
  void set_ready() {
    state = State::ready;
    was_ready = true;
  }
  /// Asks it to stop; `due` is `timeout` later.
  void stop(WallTime now, nanoseconds timeout) {
    child.send(spec.stop.signal);
    state = State::stopping;
    due = now + timeout;
  }
  void kill() {
    child.send(SIGKILL);
    killed = true;
  }
  /// Reads its output, and its ending if it has one.
  std::optional<Ending> poll() {
    if (!alive()) return std::nullopt;
    log.pump(child);
    auto end = child.reap();
    if (!end) return std::nullopt;
    log.pump(child);
    log.flush();
    child = {};
    return ending = end;
  }
  /// Decides what follows an ending: `delayed` or `ended`.
  void ended(const Ending& how, WallTime now) {
    const bool by_itself = state == State::starting || state == State::ready;
    state = State::ended;
    if (!by_itself || how.good()) return;
    if (const auto again = backoff.next(now)) {
      state = State::delayed;
      due = *again;
    }
  }
  bool alive() const { return child.pid > 0; }
  const std::string& name() const { return spec.name.text; }

  const NodeSpec spec;
  const Command command;
  LineLog log;
  Child child;
  Backoff backoff;
  State state = State::waiting;
  WallTime due{}, started{};  ///< due: of starting, delayed and stopping
  bool was_ready = false, killed = false;
  int restarts = 0;
  std::optional<Ending> ending;
  Silence silence;
};

using State = ManagedNode::State;

/// Starts the nodes of a graph, watches them, stops them in reverse.
class Supervisor {
 public:
  Supervisor(const GraphFile& graph, const Run& run, int end_fd, Fd life, News news)
      : life_(std::move(life)),
        news_(std::move(news)),
        groups_(stop_order(graph)),
        end_(end_fd),
        directory_(runtime::graph_directory(run.graph)),
        registry_(directory_) {
    clean_folder(directory_);  // a run before this one may have been killed
    for (const NodeSpec& spec : graph.nodes) {
      Command how = command(graph, spec, run);
      for (auto& variable : watchdog_.environment()) how.env.push_back(std::move(variable));
      nodes_.push_back(std::make_unique<ManagedNode>(
          spec, std::move(how), run.log + "/" + spec.name.text + ".log", run.verbose));
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
      follow_signs_of_life(Clock::now());
      follow_clock(Clock::now());
      show_progress(Clock::now());
    }
    status_line().clear();
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
    for (auto& node : nodes_) {
      bool due = node->state == State::delayed && node->due <= Clock::now();
      if (node->state == State::waiting) {
        due = true;
        for (const Text& before : node->spec.after) due = due && is_ready(before.text);
      }
      if (!due || stopping_) continue;
      try {
        node->start(Clock::now());
      } catch (const std::runtime_error& e) {
        node->state = State::ended;
        end_run(1, fmt::format("node '{}' cannot be started: {}", node->name(), e.what()));
      }
    }
  }

  /// By pid: the name a program has in the graph may differ from the one in the file (recorder).
  static bool is(const ManagedNode& node, const v1::NodeInfo& info) {
    return node.spec.host ? info.name() == node.name()
                          : static_cast<pid_t>(info.pid()) == node.child.pid;
  }

  /// Nodes of the run that do not understand each other: a lock-step would wait at every message.
  void compare_types() {
    const auto ours = [this](const v1::NodeInfo& info) {
      return std::ranges::any_of(nodes_, [&](const auto& node) { return is(*node, info); });
    };
    for (const auto& [name_a, a] : registry_.nodes()) {
      for (const auto& [name_b, b] : registry_.nodes()) {
        const auto lines = runtime::type_mismatches(a, b);
        if (!lines.empty() && ours(a) && ours(b)) return end_run(2, lines.front());
      }
    }
  }

  void follow_registry() {
    if (!registry_.poll().empty()) compare_types();
    for (const auto& [name, info] : registry_.nodes()) {
      for (auto& node : nodes_) {
        if (!is(*node, info) || !info.ready() || node->state != State::starting) continue;
        node->set_ready();
        say("{} is ready ({:.2f} s)", node->name(), to_seconds(Clock::now() - node->started));
      }
    }
  }

  void follow_endings() {
    for (auto& node : nodes_) {
      const auto ending = node->poll();
      if (!ending) continue;
      node->ended(*ending, Clock::now());
      if (stopping_) {
        node->state = State::ended;
        if (!ending->good()) say("{} {}", node->name(), ending->text());
      } else {
        failed(*node, *ending);
      }
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

  void follow_signs_of_life(WallTime now) {
    const nanoseconds passed = watched_.passed(now);
    // A full pipe has what the keeper needs.
    if (passed > nanoseconds(0) && write(life_.get(), "", 1) < 0 && errno != EAGAIN) life_.reset();
    while (const auto pid = watchdog_.next()) {
      for (auto& node : nodes_) {
        if (node->child.pid != *pid) continue;
        if (const auto hung = node->silence.heard(passed))
          say("{} goes on after {:.1f} s", node->name(), to_seconds(*hung));
      }
    }
    for (auto& node : nodes_) {
      if (node->state != State::ready) continue;
      if (node->silence.look(node->child.pid, passed))
        say("{} hangs: no sign of life for {}", node->name(), node->silence.text());
      if (node->spec.hung_after == nanoseconds(0) || !node->silence.reached(node->spec.hung_after))
        continue;
      if (node->spec.required) {
        end_run(1, fmt::format("node '{}' hung for {}", node->name(), node->silence.text()));
      } else if (node->spec.restart.on_failure && !node->killed) {
        node->child.send(SIGKILL);  // its ending starts it again
      }
    }
  }

  void follow_clock(WallTime now) {
    bool any = false;
    for (auto& node : nodes_) {
      any = any || (node->state != State::ended && node->state != State::waiting);
      if (node->state == State::starting && node->due <= now &&
          (node->spec.required || awaited(*node))) {
        end_run(1, fmt::format("node '{}' was not ready within {:g} s", node->name(),
                               to_seconds(node->spec.ready_within)));
      }
      if (node->state == State::stopping && node->due <= now && node->alive() && !node->killed) {
        say("{} did not stop in time: killed", node->name());
        node->kill();
      }
    }
    if (!any && !stopping_) end_run(0, "");  // nothing runs and nothing will
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

  void sleep() {
    std::vector<pollfd> fds = {
        {signals_.get(), POLLIN, 0}, {registry_.fd(), POLLIN, 0}, {watchdog_.fd(), POLLIN, 0}};
    if (end_ >= 0 && !stopping_) fds.push_back({end_, POLLIN, 0});
    for (const auto& node : nodes_) {
      const Child& child = node->child;
      for (const Fd* fd : {&child.pidfd, &child.out, &child.err}) {
        if (fd->open()) fds.push_back({fd->get(), POLLIN, 0});
      }
    }
    const auto now = Clock::now();
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next_due(now) - now);
    poll(fds.data(), fds.size(), static_cast<int>(std::clamp<long>(wait.count(), 0, 60'000)));
    if (end_ >= 0 && !stopping_ && (fds[3].revents & POLLIN) != 0) end_run(0, "");
  }

  Watchdog watchdog_;
  Watched watched_;
  Fd life_;  ///< to the keeper
  News news_;
  const WallTime started_ = Clock::now();
  std::vector<std::unique_ptr<ManagedNode>> nodes_;
  std::vector<std::vector<std::string>> groups_;
  int end_;                ///< readable when the run shall end; -1: none
  std::string directory_;  ///< of the graph
  runtime::Registry registry_;
  Fd signals_ = open_signals();
  Outcome outcome_;
  bool stopping_ = false, done_ = false;
  std::size_t group_ = 0;  ///< index in `groups_` of the group being stopped
  int interrupts_ = 0;
};

}  // namespace

int keep(const std::function<int(Fd)>& work,
         const std::function<void(const std::string&)>& killed) {
  std::fflush(nullptr);
  const sigset_t set = set_of({SIGINT, SIGTERM, SIGHUP, SIGCHLD});
  sigset_t before;
  sigprocmask(SIG_BLOCK, &set, &before);
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  signal(SIGPIPE, SIG_IGN);
  const pid_t keeper = getpid();
  int life[2] = {-1, -1};
  const pid_t worker = pipe2(life, O_CLOEXEC | O_NONBLOCK) == 0 ? fork() : -1;
  Fd watched(life[0]), lives(life[1]);
  if (worker < 0) {
    std::perror("mimesis: fork");
    return 1;
  }
  if (worker > 0) {
    lives.reset();
    return wait_for(worker, watched, set, killed);
  }
  watched.reset();
  // A group of its own: Ctrl-C reaches the keeper alone, which passes it on once.
  setpgid(0, 0);
  signal(SIGTTOU, SIG_IGN);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  if (getppid() != keeper) return 1;
  return work(std::move(
      lives));  // with the signals still blocked: the supervisor reads them from a descriptor
}

void clean_folder(const std::string& directory) {
  runtime::clean_graph(directory);
  namespace fs = std::filesystem;
  std::error_code ignored;
  std::vector<fs::path> sockets, folders;
  for (fs::recursive_directory_iterator it(directory, ignored), end; !ignored && it != end;
       it.increment(ignored)) {
    std::error_code gone;
    if (it->symlink_status(gone).type() == fs::file_type::socket) sockets.push_back(it->path());
    if (it->symlink_status(gone).type() == fs::file_type::directory &&
        it->path().filename() != "nodes")
      folders.push_back(it->path());
    if (it.depth() > 0) it.disable_recursion_pending();
  }
  // A datagram socket is refused where nobody is bound; a bound socket of another type is not
  // disturbed.
  const Fd probe(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  for (const fs::path& path : sockets) {
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    if (path.native().size() >= sizeof address.sun_path) continue;
    path.native().copy(address.sun_path, path.native().size());
    const auto* to = reinterpret_cast<const sockaddr*>(&address);
    if (connect(probe.get(), to, sizeof address) != 0 && errno == ECONNREFUSED)
      unlink(path.c_str());
  }
  for (const fs::path& folder : folders) rmdir(folder.c_str());  // stays unless it is empty
}

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
