#include "tools/mimesis/launch/managed_node.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace mimesis::launch {
namespace {

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

}  // namespace

LineLog::LineLog(const std::string& name, const std::string& file)
    : prefix_("[" + name + "] "),
      file_(open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (!file_.open()) throw std::runtime_error(file + ": " + std::strerror(errno));
}

void LineLog::line(std::string_view text) {
  write_all(STDERR_FILENO, prefix_ + std::string(text) + "\n");
  if (written_ > kMaxFile) return;
  written_ += text.size() + 1;
  write_all(file_.get(), std::string(text) + "\n");
  if (written_ > kMaxFile) write_all(file_.get(), "(64 MiB written: the rest is not kept)\n");
}

void LineLog::take(std::string& partial) {
  line(partial);
  if (&partial == &err_) last_error_ = partial;
  partial.clear();
}

void LineLog::pump(Fd& from, std::string& partial) {
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

void LineLog::pump(Child& child) {
  pump(child.out, out_);
  pump(child.err, err_);
}

void LineLog::flush() {
  for (std::string* partial : {&out_, &err_}) {
    if (!partial->empty()) take(*partial);
  }
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

ManagedNode::ManagedNode(const NodeSpec& spec, Command command, const std::string& log_file)
    : spec_(spec),
      command_(std::move(command)),
      log_(spec.name.text, log_file),
      backoff_(spec.restart) {}

void ManagedNode::start(WallTime now) {
  child_ = spawn(command_, spec_.sched);
  if (state_ == State::delayed) ++restarts_;
  ending_.reset();
  started_ = now;
  due_ = now + spec_.ready_within;
  state_ = State::starting;
  if (spec_.ready_when_started) set_ready();
}

void ManagedNode::set_ready() {
  state_ = State::ready;
  was_ready_ = true;
}

void ManagedNode::stop(WallTime now, std::chrono::nanoseconds timeout) {
  child_.send(spec_.stop.signal);
  state_ = State::stopping;
  due_ = now + timeout;
}

void ManagedNode::kill() {
  child_.send(SIGKILL);
  killed_ = true;
}

std::optional<Ending> ManagedNode::poll() {
  if (!alive()) return std::nullopt;
  log_.pump(child_);
  auto ending = child_.reap();
  if (!ending) return std::nullopt;
  log_.pump(child_);
  log_.flush();
  child_ = {};
  ending_ = ending;
  return ending;
}

void ManagedNode::ended(const Ending& ending, WallTime now) {
  const bool by_itself = state_ == State::starting || state_ == State::ready;
  state_ = State::ended;
  if (!by_itself || ending.good()) return;
  if (const auto again = backoff_.next(now)) {
    state_ = State::delayed;
    due_ = *again;
  }
}

}  // namespace mimesis::launch
