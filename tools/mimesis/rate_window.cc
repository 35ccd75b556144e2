#include "tools/mimesis/rate_window.h"

#include <algorithm>
#include <limits>

#include "common/time.h"

namespace mimesis::tool {

void RateWindow::add(Time arrival, std::uint64_t seq) {
  // A smaller number: the publisher was started again.
  if (!arrivals_.empty() && seq <= arrivals_.back().seq) arrivals_.clear();
  arrivals_.push_back({arrival, seq});
  if (arrivals_.size() > size_) arrivals_.pop_front();
}

std::optional<RateWindow::Rate> RateWindow::rate() const {
  if (arrivals_.size() < 2) return std::nullopt;
  Rate rate;
  rate.messages = arrivals_.back().seq - arrivals_.front().seq;
  const double span = to_seconds(arrivals_.back().time - arrivals_.front().time);
  if (span <= 0.0) return std::nullopt;
  rate.hz = static_cast<double>(rate.messages) / span;
  rate.min_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < arrivals_.size(); ++i) {
    if (arrivals_[i].seq != arrivals_[i - 1].seq + 1) continue;
    const double gap = to_seconds(arrivals_[i].time - arrivals_[i - 1].time);
    rate.min_s = std::min(rate.min_s, gap);
    rate.max_s = std::max(rate.max_s, gap);
  }
  if (rate.max_s == 0.0) rate.min_s = 0.0;  // no message followed another directly
  return rate;
}

}  // namespace mimesis::tool
