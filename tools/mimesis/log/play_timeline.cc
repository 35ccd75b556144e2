#include "tools/mimesis/log/play_timeline.h"

#include <algorithm>
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

}  // namespace mimesis::tool
