#include "hw/bridge/command_track.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mimesis::hw::bridge {
namespace {

constexpr double kShare = 0.99;  // of the limits: the limiter behind shall not interfere

Eigen::VectorXd share_of(std::span<const double> limits) {
  return kShare * Eigen::Map<const Eigen::VectorXd>(limits.data(), std::ssize(limits));
}

}  // namespace

CommandTrack::CommandTrack(Time cycle, std::span<const double> v_max, std::span<const double> a_max)
    : cycle_(cycle),
      v_max_(share_of(v_max)),
      a_max_(share_of(a_max)),
      ahead_(kAhead * a_max.size()),
      position_(a_max.size(), 0.0),
      moved_(Eigen::VectorXd::Zero(a_max_.size())),
      before_(a_max_),
      here_(a_max_),
      behind_(a_max_) {
  for (Sample& sample : samples_) sample.position_rad.resize(a_max.size());
}

void CommandTrack::begin(Time stamp, std::span<const double> position_rad,
                         std::span<const double> ahead) {
  count_ = rows_ = 0;
  told_ = false;
  add(stamp, position_rad, ahead);
  read_ = stamp - cycle_;
  step_ = cycle_;
  moved_.setZero();
  std::ranges::copy(position_rad, position_.begin());
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
  told_ = told_ || rows_ > 0;
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

/// The pace nearest to `wanted` at which the way ahead can be driven: where it turns or brakes
/// almost as hard as the joints may, it has its own pace, which falls to that by 1/s.
double CommandTrack::fastest(double wanted) {
  constexpr double kHard = 0.9;
  const double cycle_s = to_seconds(cycle_);
  double pace = wanted;
  read(read_, before_);
  read(read_ + cycle_, here_);
  for (int k = 0; pace * pace > 1.0 + 2.0 * k * cycle_s; ++k) {
    read(read_ + (k + 2) * cycle_, behind_);
    const double share =
        ((behind_ - 2.0 * here_ + before_).array().abs() / a_max_.array()).maxCoeff() /
        (kHard * cycle_s * cycle_s);
    const double there = share > 1.0 ? 1.0 : 1.0 / std::max(share, 1e-9);
    pace = std::min(pace, std::sqrt(there + 2.0 * k * cycle_s));
    std::swap(before_, here_);
    std::swap(here_, behind_);
  }
  return pace;
}

/// The step of the reading time nearest to `wanted` that takes no joint beyond its acceleration and
/// speed. A way that has none is left to the guard behind.
Time CommandTrack::bounded(Time wanted) {
  const Eigen::Map<const Eigen::VectorXd> last(position_.data(), std::ssize(position_));
  const double cycle_s = to_seconds(cycle_);
  const auto a = a_max_.array() * (cycle_s * cycle_s), v = v_max_.array() * cycle_s;
  const Time most = std::min(end() - read_, 2 * cycle_);
  Time best = wanted;
  double nearest = std::numeric_limits<double>::infinity();
  read(read_, here_);
  here_ -= last;
  // From one command to the next the positions are on a line.
  const Time grid = (back(0).stamp - read_) % cycle_;
  Time from{}, to = std::min(grid > Time(0) ? grid : grid + cycle_, most);
  for (; from < most; from = to, to = std::min(to + cycle_, most)) {
    read(read_ + to, behind_);
    behind_ -= last;
    double lowest = 0.0, highest = 1.0;  // share of the line
    for (Eigen::Index j = 0; j < here_.size(); ++j) {
      const double way = behind_[j] - here_[j];
      double low = std::max(moved_[j] - a[j], -v[j]) - here_[j];
      double high = std::min(moved_[j] + a[j], v[j]) - here_[j];
      if (std::abs(way) < 1e-12) {
        if (low > 0.0 || high < 0.0) highest = -1.0;
        continue;
      }
      if (way < 0.0) std::swap(low, high);
      lowest = std::max(lowest, low / way);
      highest = std::min(highest, high / way);
    }
    if (lowest <= highest) {
      const auto at = [&](double share) {
        return from + from_seconds(share * to_seconds(to - from));
      };
      const Time step = std::clamp(wanted, at(lowest), at(highest));
      const double distance = std::abs(to_seconds(step - wanted));
      if (distance < nearest) best = step;
      nearest = std::min(nearest, distance);
    }
    std::swap(here_, behind_);
  }
  return best;
}

/// Time of the last known set-point.
Time CommandTrack::end() const {
  return back(0).stamp + cycle_ * static_cast<int>(std::max(rows_, std::size_t{1}));
}

void CommandTrack::coast(int cycles) {
  read_ = std::min(read_ + cycles * cycle_, std::max(read_, end()));
  Eigen::Map<Eigen::VectorXd>(position_.data(), std::ssize(position_)) += cycles * moved_;
}

const std::vector<double>& CommandTrack::advance(bool brake) {
  const Time newest = back(0).stamp, behind = newest - (read_ + cycle_);
  // A change of pace is an acceleration: a fiftieth of what is missing; a tenth of a cycle at most,
  // a fifth where the joints' limits bound it, too.
  const Time most = can_brake() ? cycle_ / 5 : cycle_ / 10;
  constexpr Time kEqual = std::chrono::microseconds(1);  // rounding of rates
  const Time correction =
      behind < kEqual && behind > -kEqual ? behind : std::clamp(behind / 50, -most, most);
  Time wanted = brake ? Time(0) : cycle_ + correction;
  if (can_brake() && wanted > cycle_)
    wanted = from_seconds(fastest(to_seconds(wanted) / to_seconds(cycle_)) * to_seconds(cycle_));
  step_ = can_brake() ? bounded(wanted) : wanted;
  if (read_ + step_ > end()) step_ = std::max(Time(0), end() - read_);
  read_ += step_;
  read(read_, here_);
  Eigen::Map<Eigen::VectorXd> position(position_.data(), std::ssize(position_));
  moved_ = here_ - position;
  position = here_;
  return position_;
}

}  // namespace mimesis::hw::bridge
