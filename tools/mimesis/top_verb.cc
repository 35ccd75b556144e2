// `mimesis top`: the nodes of a graph, their load and their health, once a second.
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <deque>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>

#include "common/error.h"
#include "common/json_text.h"
#include "common/runtime/own_topics.h"
#include "proto/foxglove/log.pb.h"
#include "proto/params.pb.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/stop_signals.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Clock = std::chrono::steady_clock;

/// While one lives, the terminal on standard input gives single keys without echo. It is restored
/// however the process ends, and while it is suspended. One per process.
class TerminalKeys {
 public:
  TerminalKeys() {
    if (isatty(STDIN_FILENO) != 1 || tcgetpgrp(STDIN_FILENO) != getpgrp() ||
        tcgetattr(STDIN_FILENO, &before_) != 0) {
      return;
    }
    during_ = before_;
    during_.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    during_.c_cc[VMIN] = 0;  // read() never blocks
    during_.c_cc[VTIME] = 0;
    const auto on_deadly = [](int signal) {
      restore();
      raise(signal);  // SA_RESETHAND: now it has its default effect
    };
    for (const int signal : kDeadly) handle(signal, on_deadly, SA_RESETHAND | SA_NODEFER);
    const auto on_suspend = [](int) {
      restore();
      raise(SIGSTOP);
    };
    handle(SIGTSTP, on_suspend, SA_RESTART);
    const auto on_continue = [](int) {
      if (tcgetpgrp(STDIN_FILENO) == getpgrp()) tcsetattr(STDIN_FILENO, TCSANOW, &during_);
    };
    handle(SIGCONT, on_continue, SA_RESTART);
    ours_ = tcsetattr(STDIN_FILENO, TCSANOW, &during_) == 0;
  }
  ~TerminalKeys() {
    if (!ours_) return;
    restore();
    for (const int signal : kDeadly) handle(signal, SIG_DFL, 0);
    handle(SIGTSTP, SIG_DFL, 0);
    handle(SIGCONT, SIG_DFL, 0);
  }
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  /// Standard input; -1 if it is no terminal, belongs to another job now, or is at its end.
  int fd() const {
    // In the background reading would stop the process.
    return ours_ && !gone_ && tcgetpgrp(STDIN_FILENO) == getpgrp() ? STDIN_FILENO : -1;
  }
  /// What was typed since the last call.
  std::string read() {
    pollfd item{fd(), POLLIN, 0};
    if (poll(&item, 1, 0) <= 0) return {};
    std::array<char, 64> bytes{};
    const ssize_t n = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    gone_ = n == 0 || (n < 0 && errno != EINTR && errno != EAGAIN);
    return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(0, n))};
  }

 private:
  // Signals that kill at once. SIGINT and SIGTERM only end the loop (StopSignal).
  static constexpr std::array kDeadly{SIGHUP, SIGQUIT, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};

  // Async-signal-safe [POSIX].
  static void restore() { tcsetattr(STDIN_FILENO, TCSANOW, &before_); }
  static void handle(int signal, void (*handler)(int), int flags) {
    struct sigaction action {};
    action.sa_handler = handler;
    action.sa_flags = flags;
    sigemptyset(&action.sa_mask);
    sigaction(signal, &action, nullptr);
  }

  static inline termios before_{}, during_{};
  bool ours_ = false, gone_ = false;
};

struct Options : GraphOptions {
  int count = 0;  ///< of refreshes; 0: until stopped
};

/// Load of a process, from /proc.
struct Load {
  double cpu_s = 0.0;  ///< since its start
  std::uint64_t memory_bytes = 0;
};
/// Nothing if there is no such process on this host.
std::optional<Load> load_of(std::uint32_t pid) {
  std::ifstream in(fmt::format("/proc/{}/stat", pid));
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::size_t bracket = text.rfind(')');  // behind the name, which may hold anything
  if (bracket == std::string::npos) return std::nullopt;
  std::istringstream fields(text.substr(bracket + 2));
  std::vector<std::string> f{std::istream_iterator<std::string>(fields), {}};
  constexpr std::size_t kUser = 11, kSystem = 12, kResident = 21;  // proc(5), less the first two
  if (f.size() <= kResident) return std::nullopt;
  const double ticks = std::stod(f[kUser]) + std::stod(f[kSystem]);
  return Load{ticks / static_cast<double>(sysconf(_SC_CLK_TCK)),
              std::stoull(f[kResident]) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE))};
}

/// One node over time.
struct Watched {
  v1::NodeInfo info;
  std::optional<v1::Health> health, before;
  std::optional<Load> load;
  Clock::time_point loaded{};
  double cpu_percent = 0.0;
  std::string warning;            ///< its last one
  std::deque<std::string> lines;  ///< the newest of its log

  void look(Clock::time_point now) {
    const auto next = load_of(info.pid());
    const double seconds = to_seconds(now - loaded);
    if (next && load && seconds > 0.0) cpu_percent = 100.0 * (next->cpu_s - load->cpu_s) / seconds;
    load = next;
    loaded = now;
  }
  /// Messages a second of its own clock; nothing before its second health: one says no rate.
  std::optional<double> rate_hz() const {
    return rate_hz([](const v1::Health& h) { return h.sent(); });
  }
  /// The same of the messages of an input.
  std::optional<double> rate_hz(const std::string& topic) const {
    return rate_hz([&](const v1::Health& h) {
      const auto in = std::ranges::find(h.inputs(), topic, &v1::InputHealth::topic);
      return in != h.inputs().end() ? in->received() : 0;
    });
  }
  /// Messages that should have been taken: an input that keeps the latest overwrites by design.
  std::uint64_t dropped() const {
    std::uint64_t sum = health ? health->overflow() : 0;
    if (health) {
      for (const v1::InputHealth& in : health->inputs()) {
        const bool latest = std::ranges::any_of(info.inputs(), [&](const v1::TopicInfo& input) {
          return input.topic() == in.topic() && input.policy() == "latest";
        });
        sum += in.rejected() + (latest ? 0 : in.lost() + in.dropped());
      }
    }
    return sum;
  }
  /// Largest of its inputs [s]; negative: none has received anything.
  template <class Field>
  double worst_s(Field field) const {
    double worst = -1.0;
    if (health) {
      for (const v1::InputHealth& in : health->inputs()) {
        if (in.received() > 0) worst = std::max(worst, std::invoke(field, in));
      }
    }
    return worst;
  }
  std::string state() const {
    if (!info.ready()) return "starting";
    if (!health) return "ready";
    const bool late = before && health->overruns() > before->overruns();
    return late ? "late" : "ok";
  }

 private:
  template <class Count>
  std::optional<double> rate_hz(Count count) const {
    if (!health || !before) return std::nullopt;
    const double seconds =
        1e-9 * static_cast<double>(health->header().stamp_ns() - before->header().stamp_ns());
    if (seconds <= 0.0) return std::nullopt;
    return static_cast<double>(count(*health) - count(*before)) / seconds;
  }
};

using Json = nlohmann::ordered_json;
template <class T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}
Json seconds_or_null(double seconds) { return seconds >= 0.0 ? Json(seconds) : Json(nullptr); }
std::string ms(double seconds) {
  return seconds >= 0.0 ? fmt::format("{:.2f} ms", 1e3 * seconds) : "-";
}
std::string count(const std::optional<double>& value) {
  return value ? fmt::format("{:.0f}", *value) : "-";
}

class Top {
 public:
  explicit Top(const Options& options)
      : options_(options),
        view_(options.graph),
        tap_(
            options.graph,
            [](const std::string& topic) {
              return runtime::is_own_topic(topic, runtime::kHealthPort) ||
                     runtime::is_own_topic(topic, runtime::kLogPort);
            },
            runtime::Policy::latest),
        terminal_(!options.json && isatty(STDOUT_FILENO) == 1) {}

  int run() {
    const StopSignals stop;
    TerminalKeys keys;
    follow_nodes();
    if (nodes_.empty()) {
      std::cerr << "graph '" << options_.graph << "' has no nodes\n";
      return kNotFound;
    }
    auto refresh = Clock::now() + std::chrono::seconds(1);
    for (int shown = 0; !stop.requested() && !quit_;) {
      if (const auto tapped = tap_.next(std::chrono::milliseconds(50))) take(*tapped);
      bool changed = false;
      for (const char key : keys.read()) changed = press(key) || changed;
      if (changed && terminal_) draw();
      if (Clock::now() < refresh) continue;
      refresh += std::chrono::seconds(1);
      follow_nodes();
      options_.json ? print_json_line() : draw();
      if (options_.count > 0 && ++shown >= options_.count) return 0;
    }
    return stop.requested() ? 128 + stop.signal() : 0;
  }

 private:
  void follow_nodes() {
    std::map<std::string, Watched> now;
    for (v1::NodeInfo& info : view_.nodes()) {
      Watched& node = now[info.name()];
      const auto known = nodes_.find(info.name());
      if (known != nodes_.end() && known->second.info.start_id() == info.start_id())
        node = std::move(known->second);
      node.info = std::move(info);
      node.look(Clock::now());
    }
    nodes_ = std::move(now);
    selected_ = std::min(selected_, nodes_.empty() ? 0 : nodes_.size() - 1);
  }
  void take(const runtime::Tapped& tapped) {
    const auto node = nodes_.find(tapped.message.source);
    if (node == nodes_.end()) return;
    v1::Health health;
    foxglove::Log line;
    if (tapped.type == health.GetDescriptor()->full_name() &&
        health.ParseFromString(tapped.message.payload)) {
      node->second.before = std::move(node->second.health);
      node->second.health = std::move(health);
    } else if (tapped.type == line.GetDescriptor()->full_name() &&
               line.ParseFromString(tapped.message.payload)) {
      if (line.level() >= foxglove::Log::WARNING) node->second.warning = line.message();
      std::deque<std::string>& lines = node->second.lines;
      lines.push_back(fmt::format("{}: {}", foxglove::Log::Level_Name(line.level()),
                                  line.message().substr(0, line.message().find('\n'))));
      if (lines.size() > kLines) lines.pop_front();
    }
  }

  /// True if the picture changes.
  bool press(char key) {
    const auto chosen = std::next(nodes_.begin(), static_cast<std::ptrdiff_t>(selected_));
    if (key == 'q') quit_ = true;
    if (key == 'j' || key == 'B') selected_ = std::min(selected_ + 1, nodes_.size() - 1);
    if ((key == 'k' || key == 'A') && selected_ > 0) --selected_;
    if (chosen == nodes_.end()) return true;
    const auto pid = static_cast<pid_t>(chosen->second.info.pid());
    // A launcher starts a node again that failed, if its launch file says so (restart: on-failure).
    const bool asked = std::exchange(asked_, 0) == key;
    if ((key == 's' || key == 'r') && !asked) {
      asked_ = key;
      note_ = fmt::format("{} again: {} node {} (process {})", key,
                          key == 's' ? "stops" : "kills, so that its launcher restarts it,",
                          chosen->first, pid);
    } else if (key == 's' || key == 'r') {
      const bool done =
          load_of(chosen->second.info.pid()) && kill(pid, key == 's' ? SIGTERM : SIGKILL) == 0;
      note_ = fmt::format("{} {}", chosen->first, done ? "was told" : "is not on this host");
    } else if (key == 'l') {
      raise_log_level(chosen->second.info);
    } else {
      note_.clear();
    }
    return true;
  }

  /// More lines of a node with each call; behind the most, those of its start again.
  void raise_log_level(const v1::NodeInfo& node) {
    constexpr std::chrono::milliseconds kPatience{500};
    v1::ParamRequest request;
    v1::ParamSet answer;
    const auto ask = [&] {
      const auto bytes =
          call_service({node}, node.name() + "/params", request.SerializeAsString(), kPatience);
      const bool known = bytes && answer.ParseFromString(*bytes);
      if (!known) note_ = bytes ? "an answer that is none" : bytes.error().reason;
      return known;
    };
    if (!ask()) return;
    request.set_log_level(answer.log_level() == "error"   ? "warn"
                          : answer.log_level() == "warn"  ? "info"
                          : answer.log_level() == "debug" ? "info"
                                                          : "debug");
    if (ask()) note_ = fmt::format("{} logs from {} on", node.name(), answer.log_level());
  }

  void draw() const {
    std::ostringstream text;
    TextTable table({"", "NODE", "STATE", "CPU", "MEMORY", "MSG/S", "STEP MEAN", "WORST", "LATE",
                     "LATENCY P50", "P99", "QUEUE AGE", "INPUT AGE", "DROPPED", "BACKLOG"});
    std::size_t row = 0;
    std::string warnings;
    for (const auto& [name, node] : nodes_) {
      const v1::Health health = node.health.value_or(v1::Health());
      const bool known = node.health.has_value();
      table.row({terminal_ && row++ == selected_ ? ">" : " ", name, node.state(),
                 node.load ? fmt::format("{:.0f} %", node.cpu_percent) : "-",
                 node.load ? bytes_text(node.load->memory_bytes) : "-", count(node.rate_hz()),
                 known ? ms(health.mean_step_s()) : "-", known ? ms(health.worst_step_s()) : "-",
                 known ? std::to_string(health.overruns()) : "-",
                 ms(node.worst_s(&v1::InputHealth::latency_p50_s)),
                 ms(node.worst_s(&v1::InputHealth::latency_p99_s)),
                 ms(node.worst_s(&v1::InputHealth::queue_age_s)),
                 ms(node.worst_s(&v1::InputHealth::age_s)),
                 known ? std::to_string(node.dropped()) : "-",
                 known ? std::to_string(health.backlog()) : "-"});
      if (!node.warning.empty()) warnings += fmt::format("{}: {}\n", name, node.warning);
    }
    if (terminal_) text << "\033[H\033[J";
    text << fmt::format("graph {}: {} nodes\n\n", options_.graph, nodes_.size());
    table.print(text, use_colour(STDOUT_FILENO));
    if (!warnings.empty()) text << "\nlast warnings\n" << printable(warnings, "\n");
    if (terminal_) {
      draw_selected(text);
      text << "\nup, down: choose   l: log level   s: stop   r: restart   q: quit   " << note_
           << '\n';
    }
    std::cout << text.str() << std::flush;
  }
  void draw_selected(std::ostream& text) const {
    if (nodes_.empty()) return;
    const auto& [name, node] = *std::next(nodes_.begin(), static_cast<std::ptrdiff_t>(selected_));
    TextTable table({"INPUTS OF " + name, "MSG/S", "LATENCY P50", "P99", "QUEUED", "QUEUE AGE",
                     "AGE", "LOST", "DROPPED", "REJECTED"});
    const v1::Health health = node.health.value_or(v1::Health());
    for (const v1::InputHealth& in : health.inputs()) {
      const double any = in.received() > 0 ? 1.0 : -1.0;
      table.row({in.topic(), count(node.rate_hz(in.topic())), ms(any * in.latency_p50_s()),
                 ms(any * in.latency_p99_s()), std::to_string(in.queued()),
                 ms(any * in.queue_age_s()), ms(any * in.age_s()), std::to_string(in.lost()),
                 std::to_string(in.dropped()), std::to_string(in.rejected())});
    }
    text << '\n';
    if (!health.inputs().empty()) table.print(text, use_colour(STDOUT_FILENO));
    for (const std::string& line : node.lines) text << printable(line) << '\n';
  }

  void print_json_line() const {
    auto list = Json::array();
    for (const auto& [name, node] : nodes_) {
      const v1::Health health = node.health.value_or(v1::Health());
      Json entry{{"node", name}, {"pid", node.info.pid()}, {"state", node.state()}};
      entry["cpu_percent"] = node.load ? Json(node.cpu_percent) : nullptr;
      entry["memory_bytes"] = node.load ? Json(node.load->memory_bytes) : nullptr;
      if (node.health) {
        entry["messages_s"] = or_null(node.rate_hz());
        entry.update({{"mean_step_s", health.mean_step_s()},
                      {"worst_step_s", health.worst_step_s()},
                      {"overruns", health.overruns()},
                      {"dropped", node.dropped()},
                      {"backlog", health.backlog()},
                      {"input_age_s", seconds_or_null(node.worst_s(&v1::InputHealth::age_s))}});
        Json& inputs = entry["inputs"] = Json::array();
        for (const v1::InputHealth& in : health.inputs()) {
          inputs.push_back({{"topic", in.topic()},
                            {"messages_s", or_null(node.rate_hz(in.topic()))},
                            {"latency_p50_s", in.latency_p50_s()},
                            {"latency_p99_s", in.latency_p99_s()},
                            {"queued", in.queued()},
                            {"queue_age_s", in.queue_age_s()},
                            {"age_s", in.age_s()},
                            {"lost", in.lost()},
                            {"dropped", in.dropped()},
                            {"rejected", in.rejected()}});
        }
      }
      entry["warning"] = node.warning;
      list.push_back(std::move(entry));
    }
    std::cout << json_text(Json{{"graph", options_.graph}, {"nodes", list}}) << std::endl;
  }

  static constexpr std::size_t kLines = 5;
  const Options& options_;
  runtime::GraphView view_;
  runtime::Tap tap_;
  bool terminal_, quit_ = false;
  std::map<std::string, Watched> nodes_;
  std::size_t selected_ = 0;
  char asked_ = 0;
  std::string note_;
};

}  // namespace

void add_top(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("top");
  auto o = std::make_shared<Options>();
  verb->add_option("-n", o->count, "Number of refreshes, then end")->check(number_above_zero);
  add_graph_options(*verb, *o);
  verb->footer(
      "LATE: steps that ended after the next was due. LATENCY: age of messages at the step that "
      "took "
      "them, of the worst\ninput. QUEUE AGE: of the oldest message that waits. INPUT AGE: of the "
      "newest of the input that is silent for\nlongest. DROPPED: lost or refused inputs. All of "
      "the "
      "node's last NODE/health.\n"
      "Keys: up and down (or k, j) choose a node, whose inputs and last log lines are shown; l "
      "makes "
      "it log more (info,\ndebug, info; after warn or error first the next), s stops it, r kills "
      "it so "
      "that its launcher starts it again\n(restart: on-failure); both ask once more; q quits.\n"
      "Examples:\n  mimesis top\n  mimesis top -n 1 --json");
  verb->callback([=, &exit_code] {
    o->graph = chosen_graph(*o);
    exit_code = Top(*o).run();
  });
}

}  // namespace mimesis::tool
