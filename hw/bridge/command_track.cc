#include "hw/bridge/command_track.h"

#include <algorithm>

#include "common/math/path_pace.h"

namespace mimesis::hw::bridge {
namespace {

constexpr double kShare =
    0.95;  // of the acceleration limits: the limiter behind shall not interfere

}  // namespace

CommandTrack::CommandTrack(Time cycle, std::span<const double> a_max)
    : cycle_(cycle),
      a_max_(kShare * Eigen::Map<const Eigen::VectorXd>(a_max.data(), std::ssize(a_max))),
      ahead_(kAhead * a_max.size()),
      position_(a_max.size(), 0.0),
      before_(a_max_),
      here_(a_max_),
      behind_(a_max_) {
  for (Sample& sample : samples_) sample.position_rad.resize(a_max.size());
}

void CommandTrack::begin(Time stamp, std::span<const double> position_rad,
                         std::span<const double> ahead) {
  count_ = rows_ = 0;
  add(stamp, position_rad, ahead);
  read_ = stamp - cycle_;
  step_ = cycle_;
}

void CommandTrack::push(Time stamp, std::span<const double> position_rad) {
  newest_ = (newest_ + 1) % kKept;
  count_ = std::min(count_ + 1, kKept);
  samples_[newest_].stamp = stamp;
  std::ranges::copy(position_rad, samples_[newest_].position_rad.begin());
}

void CommandTrack::add(Time stamp, std::span<const double> position_rad,
                       std::span<const double> ahead) {
  if (count_ == 0 || stamp > back(0).stamp) {
    // Where commands are missing, the path went as the last one said.
    const Time from = count_ == 0 ? stamp : back(0).stamp;
    const std::size_t n = position_.size();
    for (std::size_t k = 0; k < rows_; ++k) {
      const Time at = from + cycle_ * static_cast<int>(k + 1);
      if (at + cycle_ / 2 > stamp) break;
      push(at, std::span(ahead_).subspan(k * n, n));
    }
    push(stamp, position_rad);
  } else {
    std::ranges::copy(position_rad, samples_[newest_].position_rad.begin());
  }
  rows_ = std::min(ahead.size() / position_.size(), kAhead);
  std::ranges::copy(ahead.first(rows_ * position_.size()), ahead_.begin());
}

/// The positions at a time of the path.
void CommandTrack::read(Time at, Eigen::VectorXd& position) const {
  const auto row = [this](std::size_t k) {  // 0: the newest command
    const double* q = k == 0 ? back(0).position_rad.data() : &ahead_[(k - 1) * position_.size()];
    return Eigen::Map<const Eigen::VectorXd>(q, std::ssize(position_));
  };
  const auto sample = [](const Sample& s) {
    return Eigen::Map<const Eigen::VectorXd>(s.position_rad.data(), std::ssize(s.position_rad));
  };
  const Time beyond = at - back(0).stamp;
  if (rows_ > 0 && beyond >= Time(0)) {
    const auto k = std::min(static_cast<std::size_t>(beyond / cycle_), rows_);
    position = row(k);
    const double share = to_seconds(beyond % cycle_) / to_seconds(cycle_);
    if (k < rows_ && share > 0.0) position += share * (row(k + 1) - row(k));
    return;
  }
  // The two commands around the time; beyond the newest it and one at least half a cycle before,
  // since two at almost the same time would make a line of any steepness.
  std::size_t n = 0, before = 1;
  while (n + 1 < count_ && back(n).stamp > at) ++n;
  while (before < count_ && back(0).stamp - back(before).stamp < cycle_ / 2) ++before;
  const Sample& from = back(n);
  position = sample(from);
  if (from.stamp >= at || (n == 0 && before >= count_)) return;
  const Sample& a = n == 0 ? back(before) : from;
  const Sample& b = n == 0 ? from : back(n - 1);
  const double share = to_seconds(at - a.stamp) / to_seconds(b.stamp - a.stamp);
  position = sample(a) + share * (sample(b) - sample(a));
}

/// The step of the reading time nearest to `wanted` that the joints' accelerations allow.
Time CommandTrack::bounded(Time wanted) {
  const double cycle_s = to_seconds(cycle_);
  read(read_ - cycle_, before_);
  read(read_, here_);
  read(read_ + cycle_, behind_);
  const double pace = to_seconds(step_) / cycle_s;
  auto [lowest, highest] =
      math::pace_rates((behind_ - here_) / cycle_s,
                       (behind_ - 2.0 * here_ + before_) / (cycle_s * cycle_s), pace, a_max_);
  // At rest before the way ends, even if a joint shall brake harder than it may.
  const double way_s = to_seconds(back(0).stamp - read_) + cycle_s * static_cast<double>(rows_);
  lowest = std::min(lowest, -pace * pace / (2.0 * std::max(way_s, cycle_s)));
  const auto step = [&](double rate) { return from_seconds((pace + rate * cycle_s) * cycle_s); };
  if (to_seconds(wanted) < (pace + lowest * cycle_s) * cycle_s) return step(lowest);
  if (to_seconds(wanted) > (pace + highest * cycle_s) * cycle_s) return step(highest);
  return wanted;
}

const std::vector<double>& CommandTrack::advance(bool brake) {
  const Time newest = back(0).stamp, behind = newest - (read_ + cycle_);
  // A change of pace is an acceleration: a fiftieth of what is missing; a tenth of a cycle at most,
  // a fifth where the joints' limits bound it, too.
  const Time most = can_brake() ? cycle_ / 5 : cycle_ / 10;
  constexpr Time kEqual = std::chrono::microseconds(1);  // rounding of rates
  const Time correction =
      behind < kEqual && behind > -kEqual ? behind : std::clamp(behind / 50, -most, most);
  const Time wanted = brake ? Time(0) : cycle_ + correction;
  step_ = can_brake() ? bounded(wanted) : wanted;
  const Time end = newest + cycle_ * static_cast<int>(std::max(rows_, std::size_t{1}));
  if (read_ + step_ > end) step_ = std::max(Time(0), end - read_);
  read_ += step_;
  read(read_, here_);
  std::ranges::copy(here_, position_.begin());
  return position_;
}

}  // namespace mimesis::hw::bridge
