// What services and keys do to a player.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "tools/mimesis/log/play_paced.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using Done = PacedPlayer::Done;

constexpr double kSeek_s = 5.0, kFaster = 1.1;  // per key
constexpr auto kLook = 100us;                   // for the next message

auto now() { return std::chrono::steady_clock::now(); }
Done failure(std::string why) { return tl::unexpected(Status{std::move(why)}); }

}  // namespace

Done PacedPlayer::pause() {
  paused_ = true;
  halt();
  tell_clock();
  bell_.ring();
  return {};
}

Done PacedPlayer::resume() {
  paused_ = false;
  step_to_.reset();
  go();
  bell_.ring();
  return {};
}

Done PacedPlayer::step(const std::string& topic) {
  if (!topic.empty() && std::ranges::find(playback_.topics(), topic, &PlayedTopic::topic) ==
                            playback_.topics().end()) {
    return failure(fmt::format("topic {} is not played", topic));
  }
  (void)pause();
  while (ahead_.front() == nullptr && !ahead_.ended()) std::this_thread::sleep_for(kLook);
  if (ahead_.ended()) return failure("the log is at its end");
  step_to_ = topic;
  if (topic.empty() && !holding_) play(*ahead_.front());  // here: the answer tells of it
  bell_.ring();
  return {};
}

Done PacedPlayer::seek(double position_s) {
  if (!std::isfinite(position_s)) return failure("position_s is not a number");
  if (position_s < 0.0) return failure("position_s is below 0");
  return seek(playback_.log_time_ns(position_s));
}

Done PacedPlayer::seek(std::uint64_t log_time_ns) {
  if (log_time_ns < playback_.start_ns() || log_time_ns > playback_.end_ns()) {
    return failure(fmt::format("{:.9f} s is outside of what is played: {:.9f} to {:.9f} s",
                               playback_.position_s(log_time_ns),
                               playback_.position_s(playback_.start_ns()),
                               playback_.position_s(playback_.end_ns())));
  }
  jump(log_time_ns);
  bell_.ring();
  return {};
}

Done PacedPlayer::seek_by(double offset_s) {
  if (!std::isfinite(offset_s)) return failure("offset_s is not a number");
  const double position_s = playback_.position_s(position_ns()) + offset_s;
  return seek(
      std::clamp(playback_.log_time_ns(position_s), playback_.start_ns(), playback_.end_ns()));
}

Done PacedPlayer::set_rate(double rate) {
  if (!(rate >= kSlowestPlay && rate <= kFastestPlay)) {
    return failure(fmt::format("rate {} is outside [{}, {}]", rate, kSlowestPlay, kFastestPlay));
  }
  timeline_.set_rate(now(), rate);
  ahead_.set_rate(rate);
  tell_clock();
  bell_.ring();
  return {};
}

void PacedPlayer::press(PlayKey key) {
  const double rate = timeline_.rate();
  switch (key) {
    case PlayKey::pause:
      (void)(paused_ ? resume() : pause());
      break;
    case PlayKey::step:
      (void)step("");
      break;
    case PlayKey::forward:
      (void)(paused_ ? step("") : seek_by(kSeek_s));
      break;
    case PlayKey::back:
      (void)seek_by(-kSeek_s);
      break;
    case PlayKey::faster:
      (void)set_rate(std::min(rate * kFaster, kFastestPlay));
      break;
    case PlayKey::slower:
      (void)set_rate(std::max(rate / kFaster, kSlowestPlay));
      break;
    case PlayKey::quit:
      quit_ = true;
      break;
  }
}

std::uint64_t PacedPlayer::position_ns() const {
  return std::clamp(static_cast<std::uint64_t>(timeline_.at(now()).count()), playback_.start_ns(),
                    playback_.end_ns());
}

v1::PlayerStatus PacedPlayer::status() {
  v1::PlayerStatus s;
  s.set_paused(paused_);
  s.set_stepping(step_to_.has_value());
  s.set_at_end(ahead_.ended());
  s.set_log_time_ns(position_ns());
  s.set_position_s(playback_.position_s(s.log_time_ns()));
  s.set_start_s(playback_.position_s(playback_.start_ns()));
  s.set_end_s(playback_.position_s(playback_.end_ns()));
  s.set_rate(timeline_.rate());
  s.set_messages(messages_);
  s.set_topic(last_topic_);
  s.set_pass(static_cast<std::uint32_t>(pass_));
  s.set_holding(holding_);
  s.set_held_s(runtime::to_seconds(held_));
  return s;
}

}  // namespace mimesis::tool
