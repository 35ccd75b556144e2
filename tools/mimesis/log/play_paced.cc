#include "tools/mimesis/log/play_paced.h"

#include <fmt/format.h>
#include <sys/prctl.h>

#include <algorithm>
#include <iostream>

#include "common/runtime/raw.h"
#include "tools/mimesis/log/play_report.h"
#include "tools/mimesis/log/play_services.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using runtime::Time;

constexpr auto kConnect = 5s;  // for those who subscribe already
constexpr auto kLook = 20ms;
constexpr auto kReadAheadAtFirst = 250ms;
constexpr auto kLastWords = 200ms;   // the last messages leave this process
constexpr auto kClockPeriod = 50ms;  // of the clock that the player drives
// The bus is served at least so often while messages follow each other without a pause.
constexpr std::uint64_t kServeMessages = 64, kServeBytes = 1 << 20;
// Half of what the bus keeps for slow reliable subscribers before it lets them miss messages.
constexpr std::uint64_t kBacklogMessages = 50'000, kBacklogBytes = 64 << 20;
constexpr auto kStuck = 5s;  // who takes nothing for so long is not waited for any more
constexpr unsigned long kTimerSlack_ns = 1000;  // how late the kernel may wake us

auto now() { return std::chrono::steady_clock::now(); }

}  // namespace

PacedPlayer::PacedPlayer(const PlayOptions& options, Playback& playback)
    : options_(options),
      playback_(playback),
      ahead_(playback, options.ahead, [this] { bell_.ring(); }),
      bus_(PlayOutput::bus_options(options.name, options.clock)),
      output_(bus_, playback.topics(), options.clock),
      timeline_(options.rate),
      paused_(options.paused) {
  ahead_.set_rate(options.rate);
  serve_player(bus_, *this);
  prctl(PR_SET_TIMERSLACK, kTimerSlack_ns);
  jump(playback.start_ns());  // who asks now is answered
  bus_.ready();
}

int PacedPlayer::run() {
  if (options_.keys) keys_.emplace();
  await_subscribers();
  await_read_ahead();
  holding_ = false;
  do {
    play_pass();
  } while (running() && next_pass());
  halt();
  tell_clock();  // it stands, for those who are still there
  keys_.reset();
  screen_.clear();
  last_words();
  return report();
}

/// Nobody who is there already shall miss the first messages.
void PacedPlayer::await_subscribers() {
  const auto give_up = now() + kConnect;
  while (running() && output_.awaits_subscribers() && now() < give_up) wait_until(now() + kLook);
}

void PacedPlayer::await_read_ahead() {
  const auto give_up = now() + kReadAheadAtFirst;
  while (running() && !ahead_.full() && now() < give_up) wait_until(give_up);
}

bool PacedPlayer::next_pass() {
  if (options_.loops > 0 && pass_ >= options_.loops) return false;
  ++pass_;
  jump(playback_.start_ns());
  return true;
}

void PacedPlayer::play_pass() {
  if (!paused_) go();
  while (running()) {
    const Played* next = ahead_.front();
    if (next == nullptr && ahead_.ended()) {
      step_to_.reset();
      if (!paused_ && !options_.stay) return;
      if (!paused_) (void)pause();
      wait_for(nullptr);
    } else if (next != nullptr &&
               (step_to_ || (!paused_ && timeline_.due(play_time(next->log_time_ns)) <= now()))) {
      play(*next);
      breathe();
    } else {
      wait_for(next);
    }
  }
}

void PacedPlayer::play(const Played& message) {
  const Time log_time = play_time(message.log_time_ns);
  const std::size_t size = message.payload.size();
  const std::string& topic = message.topic->topic;
  if (paused_) {
    timeline_.jump(now(), log_time);
    tell_clock();
    output_.send(message);
    if (step_to_ && (step_to_->empty() || *step_to_ == topic)) step_to_.reset();
  } else {
    output_.send(message);
    const Time late = now() - timeline_.due(log_time);
    lateness_.add(late);
    screen_.count(late);
  }
  last_topic_ = topic;
  ahead_.pop();
  ++messages_;
  ++unserved_;
  unserved_bytes_ += size;
}

/// Between two messages, even if they leave no time to wait.
void PacedPlayer::breathe() {
  if (unserved_ >= kServeMessages || unserved_bytes_ >= kServeBytes) wait_until(now());
  hold_for_slow();
}

/// Nothing is lost at who subscribes reliably and is slower than the log: recorded time stands
/// until it has caught up by half.
void PacedPlayer::hold_for_slow() {
  const auto behind = [this](std::uint64_t share) {
    return bus_.backlog() > kBacklogMessages / share ||
           bus_.backlog_bytes() > kBacklogBytes / share;
  };
  if (bus_.backlog() == 0) given_up_ = false;
  if (given_up_ || !behind(1)) return;
  const auto begin = now();
  auto give_up = begin + kStuck;
  holding_ = true;
  halt();
  tell_clock();
  for (std::uint64_t least = bus_.backlog(); running() && behind(2); wait_until(now() + 1ms)) {
    if (bus_.backlog() < least) give_up = now() + kStuck;
    least = std::min(least, bus_.backlog());
    if (now() < give_up) continue;
    given_up_ = true;
    screen_.clear();
    std::cerr << fmt::format("{}: a reliable subscriber takes nothing and is not waited for\n",
                             options_.name);
    break;
  }
  holding_ = false;
  held_ += now() - begin;
  if (!paused_) go();
}

/// Until `next` is due or something else is to be done.
void PacedPlayer::wait_for(const Played* next) {
  auto until = now() + 1h;
  if (next != nullptr && timeline_.running()) {
    until = std::min(until, timeline_.due(play_time(next->log_time_ns)));
  }
  wait_until(until);
}

void PacedPlayer::wait_until(Wall wall) {
  if (output_.clock()) wall = std::min(wall, next_clock_);
  if (screen_.shown()) wall = std::min(wall, screen_.next());
  const std::array<int, 3> fds{stop_signal_.fd(), bell_.fd(), keys_ ? keys_->fd() : -1};
  unserved_ = unserved_bytes_ = 0;
  const auto left = std::max<Wall::duration>(wall - now(), 0ns);
  if (bus_.wait(std::chrono::system_clock::now() + left, fds)) {
    bell_.clear();
    if (keys_) {
      for (const PlayKey key : keys_->read()) press(key);
    }
  }
  if (output_.clock() && now() >= next_clock_) tell_clock();
  draw();
}

void PacedPlayer::go() {
  if (holding_ || timeline_.running()) return;
  going_since_ = now();
  timeline_.run(going_since_);
  tell_clock();
}

void PacedPlayer::halt() {
  if (!timeline_.running()) return;
  going_ += now() - going_since_;
  const Time end = play_time(playback_.end_ns());
  timeline_.stand(now());
  if (timeline_.at(now()) > end) timeline_.jump(now(), end);
}

void PacedPlayer::jump(std::uint64_t log_time_ns) {
  step_to_.reset();
  const std::vector<PlayedValue> latched = ahead_.seek(log_time_ns);
  timeline_.jump(now(), play_time(log_time_ns));
  tell_clock();
  for (const PlayedValue& value : latched) output_.send(value);
}

void PacedPlayer::tell_clock() {
  next_clock_ = now() + kClockPeriod;
  output_.tell_clock(play_time(position_ns()), timeline_.running() ? timeline_.rate() : 0.0);
}

void PacedPlayer::draw() {
  if (!screen_.shown()) return;
  screen_.draw(now(),
               {.position_s = playback_.position_s(position_ns()),
                .end_s = playback_.position_s(playback_.end_ns()),
                .rate = timeline_.rate(),
                .paused = paused_,
                .holding = holding_},
               output_.bytes());
}

void PacedPlayer::last_words() {
  const auto end = now() + kLastWords;
  auto give_up = now() + kStuck;
  for (std::uint64_t least = bus_.backlog();
       running() && (now() < end || (bus_.backlog() > 0 && now() < give_up));
       wait_until(now() + kLook)) {
    if (bus_.backlog() < least) give_up = now() + kStuck;
    least = std::min(least, bus_.backlog());
  }
}

int PacedPlayer::report() {
  ahead_.stop();
  PlayReport report;
  report.files = options_.files;
  report.messages = messages_;
  report.bytes = output_.bytes();
  report.missed = bus_.overflow() + (quit_ ? 0 : bus_.backlog());
  report.passes = pass_;
  report.going = going_;
  report.held = held_;
  report.lateness = &lateness_;
  if (options_.json) std::cout << play_json(report) << std::endl;
  std::cerr << play_text(report);
  const bool whole = playback_.report_damages() == 0 && report.missed == 0;
  if (stop_signal_.requested()) return 130;
  return whole ? 0 : 1;
}

}  // namespace mimesis::tool
