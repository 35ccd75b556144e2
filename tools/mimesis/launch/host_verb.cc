// `mimesis host`: the launcher's hand on another host. It lives as long as the ssh connection that
// it is the command of, and speaks v1.HostOrder and v1.HostReport (host_link.h) through it.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "common/error.h"
#include "common/runtime/graph_time.h"
#include "common/runtime/keys.h"
#include "common/runtime/log.h"
#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "proto/hosts.pb.h"
#include "tools/mimesis/launch/host_link.h"
#include "tools/mimesis/launch/node_host.h"
#include "tools/mimesis/launch/subreaper.h"
#include "tools/mimesis/verb.h"

namespace mimesis::launch {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t kMostWaiting = std::size_t{4} << 20;  // bytes for a launcher that reads not
constexpr std::chrono::seconds kStop{3};                    // for nodes whose launcher is gone
constexpr Time kSlew = std::chrono::microseconds(100);      // of graph time, twice a second

struct HostOptions {
  std::string graph, host;
  double lease_s = 29.0;
};

Time monotonic() { return Clock::now().time_since_epoch(); }

/// Address of the launcher's host as seen from here.
std::string launcher_address() {
  const char* connection = std::getenv("SSH_CONNECTION");  // CLIENT PORT SERVER PORT
  const std::string text = connection != nullptr ? connection : "127.0.0.1";
  return text.substr(0, text.find(' '));
}

class HostAgent {
 public:
  HostAgent(const HostOptions& options, Fd life)
      : life_(std::move(life)),
        lease_(from_seconds(options.lease_s)),
        directory_(runtime::graph_directory(options.graph)),
        registry_((clean_folder(directory_), directory_), true),
        time_(directory_),
        far_(directory_),
        local_(directory_) {
    link_.put_raw(HostLink::kHello);
    v1::HostReport hello;
    if (const auto key = runtime::own_key()) hello.set_public_key(key->public_key);
    for (const auto& [key, name] : runtime::trusted_keys()) hello.add_trusted(key);
    link_.put(hello);
  }

  /// Until the launcher is gone or silent for too long, and its nodes have ended.
  int run() {
    WallTime heard = Clock::now(), killed{};
    for (;;) {
      sleep();
      if (write(life_.get(), "", 1) < 0 && errno != EAGAIN) life_.reset();
      const auto now = Clock::now();
      const bool open = link_.move();
      while (const auto order = link_.take<v1::HostOrder>()) {
        heard = now;
        obey(*order);
      }
      tell_pids();
      for (const HostEvent& event : local_.poll()) tell(event);
      for (const auto& change : registry_.poll()) tell(change);
      pollfd signals{signals_.get(), POLLIN, 0};
      const bool signalled = ::poll(&signals, 1, 0) > 0;
      if (!ending_ && (!open || signalled || now - heard > lease_)) {
        ending_ = true;
        killed = now + kStop;
        for (const std::string& node : local_.running()) local_.send(node, SIGINT);
      }
      if (!ending_) continue;
      if (local_.running().empty()) break;
      if (now >= killed) {
        for (const std::string& node : local_.running()) local_.send(node, SIGKILL);
      }
    }
    link_.move();
    end_descendants(0);
    clean_folder(directory_);
    life_.reset();
    return 0;
  }

 private:
  void obey(const v1::HostOrder& order) {
    if (order.has_start()) start(order.start());
    if (!order.signalled().empty()) local_.send(order.signalled(), order.signal());
    for (const std::string& node : order.gone()) far_.hide(node);
    for (const v1::NodeInfo& node : order.came())
      far_.show(runtime::seen_from_afar(node, launcher_));
    if (order.graph_offset_ns() != 0) follow(Time(order.graph_offset_ns()));
    if (order.ping_ns() == 0) return;
    v1::HostReport report;
    report.set_ping_ns(order.ping_ns());
    report.set_received_ns(monotonic().count());
    report.set_system_offset_ns(
        (std::chrono::system_clock::now().time_since_epoch() - monotonic()).count());
    report.set_graph_offset_ns(time_.offset().count());
    report.set_sent_ns(monotonic().count());
    link_.put(report);
    link_.move();
  }

  void start(const v1::HostOrder::Start& start) {
    Start here;
    Command& command = here.command;
    command.argv.assign(start.argv().begin(), start.argv().end());
    for (const std::string& variable : start.env()) {
      const std::size_t equals = variable.find('=');
      command.env.emplace_back(variable.substr(0, equals), variable.substr(equals + 1));
      std::error_code ignored;
      if (command.env.back().first == "MIMESIS_RUN_LOG")
        std::filesystem::create_directories(command.env.back().second, ignored);
    }
    here.sched.policy = start.policy();
    here.sched.priority = start.priority();
    here.sched.cpus.assign(start.cpus().begin(), start.cpus().end());
    here.sched.mlock = start.mlock();
    here.unit = start.unit();
    here.slice = start.slice();
    here.notifies = start.notifies();
    here.stop_signal = start.stop_signal();
    here.stop_timeout = Time(start.stop_timeout_ns());
    here.watchdog = Time(start.watchdog_ns());
    local_.start(start.node(), here);
  }

  /// Systemd tells a moment after the start which process it is.
  void tell_pids() {
    std::map<std::string, pid_t> pids;
    for (const std::string& node : local_.running()) {
      const pid_t pid = pids[node] = local_.pid(node);
      if (pid == 0 || told_pids_[node] == pid) continue;
      v1::HostReport report;
      report.set_node(node);
      report.set_pid(pid);
      link_.put(report);
    }
    told_pids_ = std::move(pids);
  }

  /// The first time at once: nothing runs here. Then so slowly that nobody sees a step.
  void follow(Time offset) {
    const Time by = offset - time_.offset();
    time_.set_offset(followed_ ? time_.offset() + std::clamp(by, -kSlew, kSlew) : offset);
    followed_ = true;
  }

  void tell(const HostEvent& event) {
    const bool output =
        event.kind == HostEvent::Kind::output || event.kind == HostEvent::Kind::error;
    if (output && link_.waiting() > kMostWaiting) return void(++left_out_);
    if (left_out_ > 0 && link_.waiting() < kMostWaiting / 2) {
      runtime::warn("{} lines of output did not reach the launcher", std::exchange(left_out_, 0));
    }
    v1::HostReport report;
    report.set_node(event.node);
    report.set_kind(static_cast<int>(event.kind));
    report.set_text(printable(event.text, "\t"));
    report.set_time_ns(event.time.count());
    report.set_code(event.ending.code);
    report.set_signal(event.ending.signal);
    link_.put(report);
  }
  void tell(const runtime::RegistryChange& change) {
    if (far_.shows(change.node.start_id())) return;
    std::uint64_t& told = told_[change.node.name()];
    v1::HostReport report;
    if (change.alive) {
      *report.add_came() = change.node;
      told = change.node.start_id();
    } else if (told == change.node.start_id()) {
      report.add_gone(change.node.name());
      told = 0;
    } else {
      return;  // of another host
    }
    link_.put(report);
  }

  void sleep() {
    std::vector<pollfd> fds{{registry_.fd(), POLLIN, 0}};
    if (!ending_) fds.insert(fds.end(), {{link_.in(), POLLIN, 0}, {signals_.get(), POLLIN, 0}});
    if (!ending_ && link_.waiting() > 0) fds.push_back({link_.out(), POLLOUT, 0});
    local_.watch(fds);
    const auto wait = std::min<std::chrono::milliseconds>(registry_.patience(), kLook);
    ::poll(fds.data(), fds.size(), static_cast<int>(wait.count()));
  }

  Fd life_;  ///< to the subreaper
  Time lease_;
  std::string launcher_ = launcher_address();
  std::string directory_;
  runtime::Registry registry_;
  runtime::GraphTime time_;
  runtime::FarNodes far_;
  LocalHost local_;
  HostLink link_{Fd(dup(STDIN_FILENO)), Fd(dup(STDOUT_FILENO))};
  Fd signals_ = open_signals();
  std::map<std::string, std::uint64_t> told_;  ///< start ids that the launcher knows
  std::map<std::string, pid_t> told_pids_;     ///< of running nodes
  bool followed_ = false, ending_ = false;
  std::size_t left_out_ = 0;
};

}  // namespace
}  // namespace mimesis::launch

namespace mimesis::tool {

void add_host(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand(
      "host", "Starts nodes for a launcher on another host, which calls it through ssh");
  auto options = std::make_shared<launch::HostOptions>();
  verb->add_option("--graph", options->graph, "Name of the graph")->required();
  verb->add_option("--host", options->host, "Name of this host in the launch file")->required();
  verb->add_option("--lease", options->lease_s,
                   "After so long without a word from the launcher the nodes are ended [s]");
  verb->footer("Examples:\n  ssh robot@spine mimesis host --graph default --host spine < orders");
  verb->callback([options, &exit_code] {
    runtime::set_log_name("host");
    exit_code = launch::run_below_subreaper(
        [&](launch::Fd life) { return launch::HostAgent(*options, std::move(life)).run(); },
        [](const std::string&) {});
  });
}

}  // namespace mimesis::tool
