#include "tools/mimesis/log/play_timing.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace mimesis::tool {

using runtime::Time;

Time PlayTimeline::at(Wall now) const {
  if (!running_) return log_time_;
  return log_time_ + Time(std::llround(rate_ * static_cast<double>((now - wall_).count())));
}

PlayTimeline::Wall PlayTimeline::due(Time log_time) const {
  constexpr double kFar_ns = 1e18;  // 31 years
  const double left_ns =
      std::clamp(static_cast<double>((log_time - log_time_).count()) / rate_, -kFar_ns, kFar_ns);
  return wall_ + std::chrono::nanoseconds(std::llround(left_ns));
}

void PlayTimeline::jump(Wall now, Time log_time) {
  wall_ = now;
  log_time_ = log_time;
}

void PlayTimeline::run(Wall now) {
  jump(now, at(now));
  running_ = true;
}

void PlayTimeline::stand(Wall now) {
  jump(now, at(now));
  running_ = false;
}

void PlayTimeline::set_rate(Wall now, double rate) {
  jump(now, at(now));
  rate_ = rate;
}

using runtime::Time;

void PlayLateness::add(Time late) {
  const auto ns = static_cast<std::uint64_t>(std::max<Time::rep>(late.count(), 0));
  // The leading bit chooses the octave, the five below it the bin.
  const int octave = std::max(static_cast<int>(std::bit_width(ns)) - 6, 0);
  const std::size_t bin =
      static_cast<std::size_t>(octave) * kPerOctave + static_cast<std::size_t>(ns >> octave);
  ++bins_[std::min(bin, bins_.size() - 1)];
  ++count_;
  worst_ = std::max(worst_, late);
}

Time PlayLateness::quantile(double share) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t below = 0;
  for (std::size_t bin = 0; bin < bins_.size() && count_ > 0; ++bin) {
    below += bins_[bin];
    if (below < std::max<std::uint64_t>(wanted, 1)) continue;
    // Inverse of `add`: bins below 64 hold one value each.
    const std::size_t octave = bin < 2 * kPerOctave ? 0 : bin / kPerOctave - 1;
    const std::uint64_t low = bin - octave * kPerOctave;
    return std::min(worst_, Time(static_cast<Time::rep>(((low + 1) << octave) - 1)));
  }
  return Time(0);
}

}  // namespace mimesis::tool
