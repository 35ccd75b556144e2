#include "tools/mimesis/launch/node_host.h"

#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string_view>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {
namespace {

using Kind = HostEvent::Kind;

constexpr std::size_t kMaxLine = 4096;
constexpr int kReadsPerTurn = 16, kSignsPerTurn = 1000;

/// Takes what is readable (at most 256 KiB, so that others get their turn); closes a stream at its
/// end. A line of more than 4 KiB is broken.
void pump(Fd& from, std::string& partial, const std::function<void(std::string)>& line) {
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
      if (newline || partial.size() == kMaxLine) line(std::exchange(partial, {}));
    }
  }
}

}  // namespace

LocalHost::LocalHost(const std::string& directory)
    : watchdog_(directory), epoll_(epoll_create1(EPOLL_CLOEXEC)) {
  if (!epoll_.open()) throw std::runtime_error(std::string("no epoll: ") + std::strerror(errno));
  wait_for(watchdog_.fd());
}

void LocalHost::start(const std::string& node, const Start& start) {
  try {
    Running& process = running_[node] = {};
    process.unit = start.unit;
    process.sched = start.sched;
    if (start.unit.empty()) {
      Command watched = start.command;
      for (auto& variable : watchdog_.environment("")) watched.env.push_back(std::move(variable));
      process.child = spawn(watched, start.sched);
    } else {
      if (!units_) units_.emplace(watchdog_.environment("MIMESIS_"));
      units_->start(start, process.child.out, process.child.err);
    }
    for (const Fd* fd : {&process.child.pidfd, &process.child.out, &process.child.err})
      wait_for(fd->get());
  } catch (const std::runtime_error& e) {
    running_.erase(node);
    failed_.push_back({.node = node, .kind = Kind::failed, .text = e.what()});
  }
}

void LocalHost::send(const std::string& node, int signal) {
  const auto it = running_.find(node);
  if (it == running_.end()) return;
  if (it->second.unit.empty()) {
    it->second.child.send(signal);
  } else {
    units_->send(it->second.unit, signal);
  }
}

pid_t LocalHost::pid(const Running& process) const {
  return process.unit.empty() ? process.child.pid : units_->pid(process.unit);
}

std::optional<Units::End> LocalHost::reap(Running& process) {
  if (!process.unit.empty()) return units_->reap(process.unit);
  const auto ending = process.child.reap();
  return ending ? std::optional(Units::End{*ending, {}}) : std::nullopt;
}

void LocalHost::check(const std::string& node, Running& process, bool ready,
                      std::vector<HostEvent>& events) {
  process.checked = true;
  if (process.refused) return;
  const std::string lacks = not_granted(pid(process), process.sched, ready);
  process.refused = !lacks.empty();
  if (process.refused) events.push_back({.node = node, .kind = Kind::refused, .text = lacks});
}

pid_t LocalHost::pid(const std::string& node) const {
  const auto it = running_.find(node);
  return it != running_.end() ? pid(it->second) : 0;
}

std::vector<std::string> LocalHost::running() const {
  std::vector<std::string> names;
  for (const auto& [name, process] : running_) names.push_back(name);
  return names;
}

std::vector<HostEvent> LocalHost::poll() {
  std::vector<HostEvent> events = std::exchange(failed_, {});
  const nanoseconds passed = watched_.passed(std::chrono::steady_clock::now());
  if (units_) units_->poll();
  const std::set<int> ready = readable();
  // Not for ever: whoever floods the socket must not keep the supervisor from its work.
  for (int left = kSignsPerTurn; left > 0; --left) {
    const auto sign = watchdog_.next();
    if (!sign) break;
    for (auto& [name, process] : running_) {
      if (pid(process) != sign->pid) continue;
      if (sign->ready) {
        check(name, process, true, events);
        continue;
      }
      if (const auto hung = process.silence.heard(passed))
        events.push_back({.node = name, .kind = Kind::heard, .time = *hung});
    }
  }
  for (auto it = running_.begin(); it != running_.end();) {
    const std::string& name = it->first;
    auto& process = it->second;
    const auto read_all = [&](bool ended) {
      for (const Kind kind : {Kind::output, Kind::error}) {
        const bool out = kind == Kind::output;
        Fd& from = out ? process.child.out : process.child.err;
        if (!ended && !ready.contains(from.get())) continue;
        pump(from, out ? process.out : process.err, [&](std::string line) {
          if (!process.unit.empty()) units_->log(process.unit, line);
          events.push_back({.node = name, .kind = kind, .text = std::move(line)});
        });
      }
    };
    read_all(false);
    if (!process.checked && (process.unit.empty() || units_->active(process.unit)))
      check(name, process, false, events);
    const Fd& pidfd = process.child.pidfd;
    const bool living = process.unit.empty() && pidfd.open() && !ready.contains(pidfd.get());
    if (const auto end = living ? std::nullopt : reap(process)) {
      read_all(true);
      for (std::string* partial : {&process.out, &process.err}) {
        const Kind kind = partial == &process.out ? Kind::output : Kind::error;
        if (!partial->empty()) events.push_back({.node = name, .kind = kind, .text = *partial});
      }
      if (end->failure.empty()) {
        events.push_back({.node = name, .kind = Kind::ended, .ending = end->ending});
      } else {
        events.push_back({.node = name, .kind = Kind::failed, .text = end->failure});
      }
      it = running_.erase(it);
      continue;
    }
    process.silence.look(pid(process), passed);
    if (process.silence.reached(Watchdog::kNamed)) {
      events.push_back({.node = name,
                        .kind = Kind::silent,
                        .text = process.silence.doing(),
                        .time = process.silence.length()});
    }
    ++it;
  }
  return events;
}

void LocalHost::wait_for(int fd) {
  epoll_event event{.events = EPOLLIN, .data = {.fd = fd}};
  if (fd >= 0) epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &event);  // who closes it takes it out
}

std::set<int> LocalHost::readable() const {
  std::set<int> ready;
  std::array<epoll_event, 256> events;
  const int count =
      epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), /*timeout=*/0);
  for (int i = 0; i < count; ++i) ready.insert(events[static_cast<std::size_t>(i)].data.fd);
  return ready;
}

void LocalHost::watch(std::vector<pollfd>& fds) const {
  fds.push_back({epoll_.get(), POLLIN, 0});
  if (units_) fds.push_back({units_->fd(), units_->events(), 0});
}

}  // namespace mimesis::launch
