#include "tools/mimesis/launch/managed_node.h"

#include <cmath>

namespace mimesis::launch {

std::optional<WallTime> Backoff::next(WallTime now) {
  if (!restart_.on_failure) return std::nullopt;
  while (!restarts_.empty() && now - restarts_.front() > restart_.window) restarts_.pop_front();
  if (restarts_.size() >= static_cast<std::size_t>(restart_.max)) return std::nullopt;
  const double factor = std::pow(restart_.backoff, static_cast<double>(restarts_.size()));
  const auto delay = std::chrono::duration<double, std::nano>(
      static_cast<double>(restart_.delay.count()) * factor);
  // Longer than the window makes no sense: by then the count starts anew.
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
