#include "nodes/crowd/external/path_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/circle.h"
#include "common/time.h"

namespace mimesis::crowd {
namespace {

constexpr double kLongest_s = 3.0;  // longest cycle; a slower body stands
constexpr double kGap_s = 0.5;      // longest gap of reports; then it starts again
constexpr double kMost_m_s = 5.0;   // faster bodies are not believed either
// larger jumps of the phase are not believed either
constexpr double kMost_rad = 1.0;
constexpr double kSteady = 0.05, kChanges = 0.2;  // change of a step, from one to the next
constexpr double kWay_m = 0.1;                    // a cycle that gets no farther has no direction
constexpr double kYawCycles = 2.0;                // in which β is learned
constexpr double kStepCycles = 3.0;               // in which the length of steps is
constexpr double kRests = 0.03;                   // a length that differs by less from its mean
constexpr double kLateCycles = 0.8;   // half a cycle of the mean walked, and till a step is done
constexpr double kTrimCycles = 4.0;   // in which a heading is
constexpr double kFollows_rad = 0.1;  // a body farther from the heading asked for is still turning

/// ∫(g − ⟨g⟩) dφ without its mean.
double sway(const SpeedFunction& gait, double phase_rad) {
  double way = 0.0;
  for (std::size_t k = 0; k < gait.cosine().size(); ++k) {
    const double n = static_cast<double>(k) + 1.0;
    way +=
        (gait.cosine()[k] * std::sin(n * phase_rad) - gait.sine()[k] * std::cos(n * phase_rad)) / n;
  }
  return way;
}

}  // namespace

void PathFilter::take(const AgentReport& body, Time stamp) {
  double heading = body.heading_rad, turned = 0.0;
  advance_ = 0.0;
  if (!samples_.empty()) {
    const Sample& last = samples_.back();
    const double by_s = to_seconds(stamp - last.stamp);
    const double turn = math::wrap_pi(body.phase_rad - phase_rad_);
    if (by_s > kGap_s || std::abs(turn) > kMost_rad ||
        (body.p_W_m - last.p_W_m).norm() > kMost_m_s * std::max(by_s, 0.02)) {
      samples_.clear();
    } else {
      advance_ = std::max(turn, 0.0) / math::kTwoPi;
      turned = last.turned_rad + std::max(turn, 0.0);
      heading = last.heading_rad + math::wrap_pi(heading - last.heading_rad);
      if (turn <= 0.0) samples_.pop_back();  // stands: is now here
    }
  }
  phase_rad_ = body.phase_rad;
  samples_.push_back({turned, stamp, body.p_W_m, heading});
  while (samples_.size() > 1 && (samples_[1].turned_rad <= turned - math::kTwoPi ||
                                 to_seconds(stamp - samples_[0].stamp) > kLongest_s)) {
    samples_.pop_front();
  }
}

PathFilter::Sample PathFilter::at(double turned_rad) const {
  const auto next = std::ranges::lower_bound(samples_, turned_rad, {}, &Sample::turned_rad);
  if (next == samples_.begin()) return samples_.front();
  const Sample &a = *std::prev(next), &b = *next;
  const double s = (turned_rad - a.turned_rad) / (b.turned_rad - a.turned_rad);
  return {turned_rad, a.stamp, a.p_W_m + s * (b.p_W_m - a.p_W_m),
          a.heading_rad + s * (b.heading_rad - a.heading_rad)};
}

/// Over the last 2π of the phase, or all that there is.
PathFilter::Mean PathFilter::mean() const {
  const Sample& end = samples_.back();
  const double from = std::max(end.turned_rad - math::kTwoPi, samples_.front().turned_rad);
  const double range = end.turned_rad - from;
  if (!(range > 0.0)) return {.p_W_m = end.p_W_m, .heading_rad = end.heading_rad};
  const Sample begin = at(from), middle = at(from + 0.5 * range);
  Mean m{.moved_m = end.p_W_m - begin.p_W_m, .turned_rad = end.heading_rad - begin.heading_rad};
  Sample a = begin;
  for (const Sample& b : samples_) {
    if (b.turned_rad <= from) continue;
    const double weight = 0.5 * (b.turned_rad - a.turned_rad) / range;
    m.p_W_m += weight * (a.p_W_m + b.p_W_m);
    m.heading_rad += weight * (a.heading_rad + b.heading_rad);
    a = b;
  }
  // Steps that become longer or shorter, by how much of them.
  const double first = (middle.p_W_m - begin.p_W_m).norm(),
               then = (end.p_W_m - middle.p_W_m).norm();
  const double changes = std::abs(then - first) / std::max(then + first, 1e-9);
  m.range = range / math::kTwoPi;
  m.share = m.range * std::clamp((kChanges - changes) / (kChanges - kSteady), 0.0, 1.0);
  return m;
}

AgentReport PathFilter::step(const AgentReport& body, Time stamp, const SpeedFunction& gait) {
  take(body, stamp);
  const Mean m = mean();
  const bool whole = m.range > 1.0 - 1e-9;
  const double way = m.moved_m.norm();
  cycle_m_ = whole && m.share > 0.5 ? way : 0.0;
  if (whole && m.share > 0.5 && way > kWay_m) {
    const double direction = std::atan2(m.moved_m.y(), m.moved_m.x());
    const double share = yaw_known_ ? std::min(advance_ / kYawCycles, 1.0) : 1.0;
    yaw_rad_ += share * math::wrap_pi(m.heading_rad - direction - yaw_rad_);
    yaw_known_ = true;
  }
  const double share = m.share, raw = 1.0 - share;
  const double heading = m.heading_rad + 0.5 * m.turned_rad;
  AgentReport walker = body;
  walker.heading_rad =
      math::wrap_pi(heading + raw * math::wrap_pi(body.heading_rad - heading) - share * yaw_rad_);
  // The length of a cycle as far as one is known.
  const double stride =
      m.range > 0.0 ? way / m.range / (math::kTwoPi * gait.mean()) : 0.0;  // in those of the gait
  const Eigen::Vector2d ahead(std::cos(walker.heading_rad), std::sin(walker.heading_rad));
  walker.p_W_m = raw * body.p_W_m +
                 share * (m.p_W_m + 0.5 * m.moved_m + stride * sway(gait, body.phase_rad) * ahead);
  walker.speed_m_s =
      raw * body.speed_m_s + share * stride * body.phase_rate_rad_s * gait(body.phase_rad);
  return walker;
}

void StepGain::learn(double asked_m, double walked_m, double cycles) {
  if (!(asked_m > 0.0 && walked_m > 0.0)) return;
  const auto follow = [&](double& smooth, double now, double in_cycles) {
    smooth += (smooth > 0.0 ? std::min(cycles / in_cycles, 1.0) : 1.0) * (now - smooth);
    return std::abs(now - smooth) < kRests * smooth;
  };
  const bool asked_rests = follow(asked_late_m_, asked_m, kLateCycles);
  if (!follow(walked_smooth_m_, walked_m, 1.0) || !asked_rests) return;
  const double gain = std::clamp(walked_m / asked_late_m_, 0.8, 1.25);
  value_ += std::min(cycles / kStepCycles, 1.0) * (gain - value_);
}

void HeadingTrim::learn(double asked_rad, double walked_rad, double cycles) {
  const double left = math::wrap_pi(asked_rad - walked_rad);
  if (std::abs(left) > kFollows_rad) return;
  value_rad_ = std::clamp(value_rad_ + std::min(cycles / kTrimCycles, 1.0) * left, -0.2, 0.2);
}

double settling_s(const HeadingRule& rule, double phase_rate_rad_s) {
  const bool by_gait = rule.kind == HeadingKind::lane || rule.kind == HeadingKind::consensus;
  const double rate = rule.gain * (by_gait ? std::max(phase_rate_rad_s, 0.0) : 1.0);
  const bool turns = rule.kind != HeadingKind::keep && rate > 0.0;
  return turns ? 1.0 / rate : std::numeric_limits<double>::infinity();
}

}  // namespace mimesis::crowd
