#include "hw/sim/udp/controller.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/time.h"

namespace mimesis::hw::sim {
namespace {

constexpr std::size_t kHead = 24;

template <class Number>
Number at(std::string_view bytes, std::size_t offset) {
  Number number;
  std::memcpy(&number, bytes.data() + offset, sizeof number);
  return number;
}

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

}  // namespace

Controller::Controller(const ControllerConfig& config)
    : config_(config),
      position_(config.home_rad),
      velocity_(config.home_rad.size(), 0.0),
      goal_(config.home_rad) {}

void Controller::enter(Condition condition, Time now) {
  condition_ = condition;
  entered_ = now;
}

void Controller::fail(std::uint16_t number) {
  fault_ = number;
  condition_ = kFault;
}

void Controller::handle(const std::string& from, std::string_view bytes, Time now) {
  const std::size_t n = position_.size();
  if (bytes.size() != kHead + 16 * n || bytes.substr(0, 4) != "MJC1" ||
      at<std::uint8_t>(bytes, 17) != n)
    return;
  const auto session = at<std::uint32_t>(bytes, 4), sequence = at<std::uint32_t>(bytes, 8);
  if (session == 0) return;
  if (session_ != 0 && (session != session_ || from != from_)) return;  // has its master
  if (session_ != 0 && static_cast<std::int32_t>(sequence - heard_) <= 0) return;
  if (session_ == 0) may_follow_ = false;
  from_ = from;
  session_ = session;
  heard_ = sequence;
  commanded_ = now;
  watchdog_ = std::chrono::milliseconds(at<std::uint16_t>(bytes, 18));
  if (at<std::uint32_t>(bytes, 20) != config_.session) return;  // it has not heard us yet
  const auto order = at<std::uint8_t>(bytes, 16);
  if (order == 1) return follow(bytes, n, now);
  may_follow_ = true;
  if (order == 2 && condition_ == kFault) {
    fault_ = 0;
    enter(kOff, now);
  }
  if (condition_ == kFollows || condition_ == kEnabling) enter(kStopping, now);
}

void Controller::follow(std::string_view bytes, std::size_t n, Time now) {
  if (condition_ == kFault || condition_ == kStopping) return;
  for (std::size_t i = 0; i < n; ++i) {
    const auto q = at<double>(bytes, kHead + 8 * i), v = at<double>(bytes, kHead + 8 * (n + i));
    if (!(std::abs(q) < 1e3) || !(std::abs(v) <= 1.01 * config_.v_max_rad_s[i])) return fail(1);
    if (condition_ == kOff && std::abs(q - position_[i]) > config_.start_tolerance_rad)
      return fail(2);
    goal_[i] = q;
  }
  if (condition_ == kOff && may_follow_) enter(kEnabling, now);
}

void Controller::advance(Time now) {
  const double dt = to_seconds(now - now_.value_or(now));
  now_ = now;
  if (commanded_ && now - *commanded_ > watchdog_) {
    commanded_.reset();
    session_ = heard_ = 0;  // free for another master
    if (condition_ == kFollows || condition_ == kEnabling) enter(kStopping, now);
  }
  if (condition_ == kEnabling && now - entered_ >= from_seconds(config_.enabling_s))
    enter(kFollows, now);
  if (dt <= 0.0) return;
  bool moves = false;
  for (std::size_t i = 0; i < position_.size(); ++i) {
    double v = 0.0;
    if (condition_ == kFollows && !jammed_) {
      const double most = 1.2 * config_.v_max_rad_s[i];
      v = std::clamp((goal_[i] - position_[i]) / dt, -most, most);
    } else if (condition_ == kStopping && !jammed_) {
      const double slower = std::max(0.0, std::abs(velocity_[i]) - config_.a_max_rad_s2[i] * dt);
      v = std::copysign(slower, velocity_[i]);
    }
    velocity_[i] = v;
    position_[i] += v * dt;
    moves = moves || v != 0.0;
  }
  if (condition_ == kStopping && !moves) enter(kOff, now);
}

std::string Controller::state() {
  std::string bytes = "MJS1";
  append(bytes, config_.session);
  append(bytes, ++sequence_);
  append(bytes, heard_);
  append(bytes, static_cast<std::uint8_t>(condition_));
  append(bytes, static_cast<std::uint8_t>(position_.size()));
  append(bytes, fault_);
  append(bytes, session_);
  for (const double q : position_) append(bytes, q);
  for (const double v : velocity_) append(bytes, v);
  for (std::size_t i = 0; i < position_.size(); ++i) append(bytes, 0.0);
  return bytes;
}

}  // namespace mimesis::hw::sim
