#include "hw/bridge/command_track.h"

#include <algorithm>

namespace mimesis::hw::bridge {

void CommandTrack::begin(Time stamp, std::span<const double> position_rad) {
  count_ = 0;
  add(stamp, position_rad);
  read_ = stamp - cycle_;
}

void CommandTrack::add(Time stamp, std::span<const double> position_rad) {
  if (count_ == 0 || stamp > back(0).stamp) {
    newest_ = (newest_ + 1) % kKept;
    count_ = std::min(count_ + 1, kKept);
    samples_[newest_].stamp = stamp;
  }
  std::ranges::copy(position_rad, samples_[newest_].position_rad.begin());
}

const std::vector<double>& CommandTrack::advance() {
  const Time newest = back(0).stamp, behind = newest - (read_ + cycle_);
  // A change of pace is an acceleration: a fiftieth of what is missing, a tenth of a cycle at most.
  constexpr Time kEqual = std::chrono::microseconds(1);  // rounding of rates
  const Time correction = behind < kEqual && behind > -kEqual
                              ? behind
                              : std::clamp(behind / 50, -cycle_ / 10, cycle_ / 10);
  read_ = std::min(read_ + cycle_ + correction, newest + cycle_);
  // The two commands around the reading time; beyond the newest it and one at least half a cycle
  // before, since two at almost the same time would make a line of any steepness.
  std::size_t n = 0, before = 1;
  while (n + 1 < count_ && back(n).stamp > read_) ++n;
  while (before < count_ && newest - back(before).stamp < cycle_ / 2) ++before;
  const Sample& from = back(n);
  if (from.stamp >= read_ || (n == 0 && before >= count_)) {
    position_ = from.position_rad;
    return position_;
  }
  const Sample& a = n == 0 ? back(before) : from;
  const Sample& b = n == 0 ? from : back(n - 1);
  const double share = to_seconds(read_ - a.stamp) / to_seconds(b.stamp - a.stamp);
  for (std::size_t i = 0; i < position_.size(); ++i) {
    position_[i] = a.position_rad[i] + share * (b.position_rad[i] - a.position_rad[i]);
  }
  return position_;
}

}  // namespace mimesis::hw::bridge
