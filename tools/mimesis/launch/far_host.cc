#include "tools/mimesis/launch/far_host.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/runtime/raw.h"
#include "common/runtime/registry.h"
#include "common/time.h"
#include "tools/mimesis/launch/subreaper.h"
#include "tools/mimesis/table.h"

namespace mimesis::launch {
namespace {

using Kind = HostEvent::Kind;
using namespace std::chrono_literals;

constexpr auto kSilent = 2s;  // then it is lost
constexpr auto kPing = 500ms;
constexpr auto kFirstPing = 20ms;   // until the clock is known
constexpr std::size_t kEnough = 8;  // samples for that
constexpr auto kReconnect = 1s;
constexpr auto kEnds = 1s;         // ssh, once it has closed its output
constexpr auto kConnecting = 30s;  // ssh with its logins
constexpr Time kAhead = 1ms;       // clocks further apart are named

}  // namespace

FarHost::FarHost(Host spec, std::string graph, const runtime::GraphTime& time)
    : spec_(std::move(spec)), graph_(std::move(graph)), time_(time) {
  connect();
}

void FarHost::connect() {
  // Shorter than ours, so that its nodes have ended when we start them again.
  const double lease_s = to_seconds(spec_.lost_after) - 1.0;
  const std::string line = fmt::format("exec {}/bin/mimesis-host --graph {} --host {} --lease {:g}",
                                       tool::shell_word(spec_.prefix), tool::shell_word(graph_),
                                       tool::shell_word(name()), lease_s);
  int in[2];
  if (pipe2(in, O_CLOEXEC) != 0) throw std::runtime_error("no pipe to ssh");
  Fd read_end(in[0]), write_end(in[1]);
  ssh_ = spawn(ssh(spec_, line), {}, {.input = read_end.get()});
  link_ = HostLink(std::move(ssh_.out), std::move(write_end));
  connected_ = heard_ = std::chrono::steady_clock::now();
  next_ping_ = {};
  greeted_ = up_ = pinged_ = false;
  hello_.reset();
  offset_ = {};
  for (const auto& [node, info] : shown_) show(info);
}

void FarHost::reconnect() {
  const auto now = std::chrono::steady_clock::now();
  if (ssh_.pid > 0 || now - connected_ < kReconnect) return;
  connect();
}

void FarHost::start(const std::string& node, const Start& start) {
  v1::HostOrder order;
  v1::HostOrder::Start& there = *order.mutable_start();
  there.set_node(node);
  for (const std::string& word : start.command.argv) there.add_argv(word);
  for (const auto& [name, value] : start.command.env) there.add_env(name + "=" + value);
  there.set_policy(start.sched.policy);
  there.set_priority(start.sched.priority);
  for (const int cpu : start.sched.cpus) there.add_cpus(cpu);
  there.set_mlock(start.sched.mlock);
  there.set_unit(start.unit);
  there.set_slice(start.slice);
  there.set_notifies(start.notifies);
  there.set_stop_signal(start.stop_signal);
  there.set_stop_timeout_ns(start.stop_timeout.count());
  there.set_watchdog_ns(start.watchdog.count());
  link_.put(order);
  running_[node] = -1;
}

void FarHost::send(const std::string& node, int signal) {
  // Nobody hears it: there they end by themselves, and the run does not wait for that.
  abandoned_ = abandoned_ || (signal == SIGKILL && silent_);
  v1::HostOrder order;
  order.set_signalled(node);
  order.set_signal(signal);
  link_.put(order);
}

pid_t FarHost::pid(const std::string& node) const {
  const auto it = running_.find(node);
  return it != running_.end() ? it->second : 0;
}

void FarHost::show(const v1::NodeInfo& node) {
  shown_[node.name()] = node;
  v1::HostOrder order;
  *order.add_came() = node;
  link_.put(order);
}

void FarHost::hide(const std::string& node, std::uint64_t start_id) {
  const auto it = shown_.find(node);
  if (it == shown_.end() || it->second.start_id() != start_id) return;
  shown_.erase(it);
  v1::HostOrder order;
  order.add_gone(node);
  link_.put(order);
}

std::vector<HostEvent> FarHost::poll() {
  std::vector<HostEvent> events;
  if (ssh_.pid <= 0) return events;
  const auto now = std::chrono::steady_clock::now();
  if (now >= next_ping_) {
    next_ping_ = now + (greeted_ && !up_ ? std::chrono::milliseconds(kFirstPing) : kPing);
    // One at a time: those that a cut has held back would tell of it, not of the clocks.
    if (greeted_ && !std::exchange(pinged_, true)) {
      v1::HostOrder order;
      order.set_ping_ns(time_.now().count());
      link_.put(order);
    }
  }
  const bool open = link_.move();
  char bytes[4096];
  for (ssize_t n; (n = read(ssh_.err.get(), bytes, sizeof bytes)) > 0;)
    errors_.append(bytes, static_cast<std::size_t>(n));
  for (std::size_t end; (end = errors_.find('\n')) != std::string::npos;
       errors_.erase(0, end + 1)) {
    last_error_ = printable(errors_.substr(0, errors_.find_last_not_of("\r\n", end) + 1), "\t");
    say("[{}] {}", name(), last_error_);
  }
  greeted_ = greeted_ || link_.greeted();
  while (const auto report = greeted_ ? link_.take<v1::HostReport>() : std::nullopt) {
    heard_ = now;
    take(*report, events);
  }
  follow_silence(now);
  const auto ending = ssh_.reap();
  // ssh closes its output before it ends, and its exit code says more.
  if (open || !closed_) closed_ = now;
  if (ending || (!open && now - *closed_ > kEnds)) {
    if (!ending) ssh_.send(SIGKILL);
    close(ending ? "ssh " + ending->text() : "the connection ended", events);
  } else if (abandoned_ || now - heard_ > (was_up_ ? spec_.lost_after : nanoseconds(kConnecting))) {
    ssh_.send(SIGKILL);
    close(fmt::format("no sign of life for {:.0f} s; its nodes end by themselves",
                      to_seconds(now - heard_)),
          events);
  }
  return events;
}

void FarHost::take(const v1::HostReport& report, std::vector<HostEvent>& events) {
  if (!hello_) hello_ = report;
  if (report.ping_ns() != 0) {
    pinged_ = false;
    measure(report);
  }
  if (report.pid() != 0) running_[report.node()] = report.pid();
  if (report.pid() == 0 && !report.node().empty()) {
    HostEvent event{.node = report.node(),
                    .kind = static_cast<Kind>(report.kind()),
                    .text = report.text(),
                    .time = nanoseconds(report.time_ns()),
                    .ending = {.code = report.code(), .signal = report.signal()}};
    if (event.kind == Kind::ended || event.kind == Kind::failed) running_.erase(event.node);
    events.push_back(std::move(event));
  }
  for (const std::string& node : report.gone()) forget(node);
  for (const v1::NodeInfo& node : report.came()) {
    const auto known = nodes_.find(node.name());
    if (known != nodes_.end() && known->second.start_id() != node.start_id()) forget(node.name());
    nodes_[node.name()] = runtime::seen_from_afar(node, address());
    nodes_[node.name()].set_host(name());
    news_.push_back({nodes_[node.name()], true});
  }
}

void FarHost::forget(const std::string& node) {
  const auto it = nodes_.find(node);
  if (it == nodes_.end()) return;
  news_.push_back({std::move(it->second), false});
  nodes_.erase(it);
}

void FarHost::measure(const v1::HostReport& report) {
  offset_.add(Time(report.ping_ns()), Time(report.received_ns()), Time(report.sent_ns()),
              time_.now());
  if (offset_.size() < kEnough && !up_) return;
  const ClockOffset::Sample& best = offset_.best();
  v1::HostOrder order;
  order.set_graph_offset_ns(best.graph_minus_there.count());
  link_.put(order);
  graph_ahead_ = up_ ? Time(report.graph_offset_ns()) - best.graph_minus_there : Time(0);
  // Monotonic times: there - here = time_.offset() - graph_minus_there.
  system_ahead_ = time_.offset() - best.graph_minus_there + Time(report.system_offset_ns()) -
                  runtime::system_offset();
  if (!up_ && was_up_) say("host '{}' is back", name());
  up_ = was_up_ = true;
  const bool apart = std::abs(system_ahead_.count()) > (kAhead + best.delay / 2).count();
  if (apart && !clock_named_) {
    say("warning: the system clock of host '{}' is {:+.1f} ms ahead of this one's (+-{:.1f} ms); "
        "graph time is corrected, but set the clocks (chrony)",
        name(), to_seconds(system_ahead_) * 1e3, to_seconds(best.delay) * 500);
  }
  clock_named_ = apart;
}

void FarHost::follow_silence(WallTime now) {
  if (!up_) return;
  const bool silent = now - heard_ > kSilent;
  if (silent && !silent_) {
    say("host '{}' is lost: no sign of life for {:g} s", name(), to_seconds(kSilent));
  } else if (silent_ && !silent) {
    say("host '{}' is back", name());
  }
  silent_ = silent;
}

void FarHost::close(const std::string& why, std::vector<HostEvent>& events) {
  ssh_ = {};  // its process is reaped with the descendants
  if (!was_up_) {
    failure_ = fmt::format("host '{}' cannot be used: {}{}", name(), why,
                           last_error_.empty() ? "" : ": " + last_error_);
  } else if (!running_.empty() || up_) {
    say("host '{}' is lost: {}", name(), why);
  }
  up_ = silent_ = abandoned_ = false;
  closed_.reset();
  while (!nodes_.empty()) forget(std::string(nodes_.begin()->first));
  for (const auto& [node, pid] : std::exchange(running_, {}))
    events.push_back({.node = node, .kind = Kind::ended, .ending = {.code = 255, .lost = name()}});
}

bool FarHost::disconnect(bool in_time) {
  link_ = {};
  if (!in_time || silent_) ssh_.send(SIGKILL);
  return ssh_.pid <= 0 || ssh_.reap().has_value();
}

void FarHost::watch(std::vector<pollfd>& fds) const {
  if (ssh_.pid <= 0) return;
  fds.push_back({link_.in(), POLLIN, 0});
  fds.push_back({ssh_.pidfd.get(), POLLIN, 0});
  fds.push_back({ssh_.err.get(), POLLIN, 0});
  if (link_.waiting() > 0) fds.push_back({link_.out(), POLLOUT, 0});
}

v1::HostStatus FarHost::status() const {
  v1::HostStatus status;
  status.set_host(name());
  status.set_lost(!up_ || silent_);
  status.set_system_ahead_s(to_seconds(system_ahead_));
  status.set_graph_ahead_s(to_seconds(graph_ahead_));
  if (offset_.size() > 0) status.set_delay_s(to_seconds(offset_.best().delay));
  return status;
}

}  // namespace mimesis::launch
