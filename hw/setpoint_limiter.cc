#include "hw/setpoint_limiter.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::hw {
namespace {

/// Fastest velocity from which braking at `a` still ends within `distance`, in steps of `dt`.
double braking_velocity(double distance, double a, double dt) {
  const double half = 0.5 * a * dt;
  return std::sqrt(half * half + 2.0 * a * std::max(distance, 0.0)) - half;
}

/// Way until rest from velocity v and acceleration a, both towards the end of the way, braking as
/// hard as `a_max` and `jerk` allow: the acceleration falls to −p, stays, and rises to 0, with
/// p = min(a_max, √(j (v + a²/2j))). Set-points in steps of `dt` go v dt/2 less.
double stopping_way(double v, double a, double a_max, double jerk, double dt) {
  if (v <= 0.0 && a <= 0.0) return 0.0;
  if (a < 0.0 && 2.0 * jerk * v <= a * a) {  // brakes harder than it has to: turns back
    const double t = (-a - std::sqrt(a * a - 2.0 * jerk * v)) / jerk;
    return v * t + a * t * t / 2.0 + jerk * t * t * t / 6.0 - v * dt / 2.0;
  }
  const double highest = v + a * a / (2.0 * jerk);  // velocity, were `a` to fall to 0 first
  if (highest <= 0.0) return 0.0;
  const double p = std::min(a_max, std::sqrt(jerk * highest));
  const double hold = (highest - p * p / jerk) / p;
  const double fall = std::max((a + p) / jerk, 0.0);
  const double v1 = v + a * fall - jerk * fall * fall / 2.0;
  return v * fall + a * fall * fall / 2.0 - jerk * fall * fall * fall / 6.0 + v1 * hold -
         p * hold * hold / 2.0 + p * p * p / (6.0 * jerk * jerk) - v * dt / 2.0;
}

/// The number nearest to `best` between it and `good`, up to 2^-24 of the way, for which `holds`.
/// Precondition: it holds for `good`.
template <class Predicate>
double nearest(double good, double best, const Predicate& holds) {
  if (holds(best)) return best;
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (good + best);
    (holds(middle) ? good : best) = middle;
  }
  return good;
}

constexpr double kRounding = 1e-6;  // [rad/s²]

}  // namespace

SetpointLimiter::SetpointLimiter(JointLimits limits, double dt_s)
    : limits_(std::move(limits)),
      dt_(dt_s),
      q_(limits_.q_min),
      v_(limits_.q_min),
      a_(limits_.q_min),
      target_(limits_.q_min),
      stream_(limits_.q_min) {
  const Eigen::Index n = limits_.q_min.size();
  MIMESIS_ASSERT(limits_.q_max.size() == n && limits_.v_max.size() == n &&
                 limits_.a_max.size() == n);
  MIMESIS_ASSERT(dt_ > 0.0 && (limits_.v_max.array() > 0.0).all() &&
                 (limits_.a_max.array() > 0.0).all());
  if (limits_.j_max.size() == 0) limits_.j_max = Eigen::VectorXd::Zero(n);
  MIMESIS_ASSERT(limits_.j_max.size() == n && (limits_.j_max.array() >= 0.0).all());
  rest();
}

void SetpointLimiter::reset(std::span<const double> q) {
  const Eigen::Map<const Eigen::VectorXd> start(q.data(), static_cast<Eigen::Index>(q.size()));
  q_ = start;
  rest();
  target_ = start.cwiseMax(limits_.q_min).cwiseMin(limits_.q_max);
}

void SetpointLimiter::advance(Eigen::Index i, double wanted) {
  const double a = limits_.a_max[i], v_max = limits_.v_max[i];
  double v = std::clamp(wanted, -v_max, v_max);
  v = std::clamp(v, v_[i] - a * dt_, v_[i] + a * dt_);
  v = std::clamp(v, -braking_velocity(q_[i] - limits_.q_min[i], a, dt_),
                 braking_velocity(limits_.q_max[i] - q_[i], a, dt_));
  move(i, v);
}

void SetpointLimiter::move(Eigen::Index i, double v) {
  a_[i] = (v - v_[i]) / dt_;
  v_[i] = v;
  q_[i] = std::clamp(q_[i] + v * dt_, std::min(q_[i], limits_.q_min[i]),
                     std::max(q_[i], limits_.q_max[i]));
}

/// After a cycle with acceleration `a` the joint can keep its speed and its end on the side of
/// `towards` (±1). `slack`: 1 for a stream that uses the limits up, in steps.
bool SetpointLimiter::may(Eigen::Index i, double a, double towards, double slack) const {
  const double jerk = limits_.j_max[i], toward_a = a * towards;
  const double v = (v_[i] + a * dt_) * towards;
  const double rises = toward_a > 0.0 ? toward_a * (toward_a / jerk - slack * dt_) / 2.0 : 0.0;
  if (v + rises > limits_.v_max[i] + kRounding * dt_) return false;
  const double q = q_[i] + v * towards * dt_;
  const double room = towards > 0.0 ? limits_.q_max[i] - q : q - limits_.q_min[i];
  return stopping_way(v, toward_a, limits_.a_max[i], jerk, dt_) <= room + 1e-9;
}

/// Acceleration of the next cycle, see above.
double SetpointLimiter::smooth(Eigen::Index i, const Stream& stream) const {
  const double a_max = limits_.a_max[i], step = limits_.j_max[i] * dt_;
  const double low = std::max(a_[i] - step, -a_max), high = std::min(a_[i] + step, a_max);
  // Onto the stream at once, if its velocity and acceleration can be met in the next two cycles.
  const double exact = ((stream.end - q_[i]) / dt_ - v_[i]) / dt_;
  const double differs = ((stream.end - q_[i]) / dt_ - stream.velocity) / dt_;
  const bool meets = exact >= low - kRounding && exact <= high + kRounding &&
                     std::abs(stream.acceleration - differs - exact) <= step + kRounding &&
                     std::abs(differs) <= step + kRounding;
  if (meets && may(i, exact, 1.0, 1.0) && may(i, exact, -1.0, 1.0)) return exact;
  const double lag = stream.end - q_[i] - stream.velocity * dt_;
  const double towards = lag >= 0.0 ? 1.0 : -1.0;
  const double away = towards > 0.0 ? low : high, nearer = towards > 0.0 ? high : low;
  const double a = nearest(away, nearer, [&](double x) {
    const double v = v_[i] + x * dt_;
    return may(i, x, towards, 0.0) &&
           stopping_way((v - stream.velocity) * towards, (x - stream.acceleration) * towards, a_max,
                        limits_.j_max[i], dt_) <= (stream.end - (q_[i] + v * dt_)) * towards;
  });
  return may(i, a, -towards, 0.0)
             ? a
             : nearest(nearer, a, [&](double x) { return may(i, x, -towards, 0.0); });
}

bool SetpointLimiter::follow(std::span<const double> target, bool brakes) {
  MIMESIS_ASSERT(static_cast<Eigen::Index>(target.size()) == q_.size());
  bool limited = false;
  for (Eigen::Index i = 0; i < q_.size(); ++i) {
    const double asked = target[static_cast<std::size_t>(i)];
    const double end = std::clamp(asked, limits_.q_min[i], limits_.q_max[i]);
    const double stream = std::clamp((end - target_[i]) / dt_, -limits_.v_max[i], limits_.v_max[i]);
    if (limits_.j_max[i] > 0.0 && !brakes) {
      const double a = std::clamp((stream - stream_[i]) / dt_, -limits_.a_max[i], limits_.a_max[i]);
      advance(i, v_[i] + smooth(i, {end, stream, a}) * dt_);
    } else {
      const double lag = end - (q_[i] + stream * dt_);
      const double approach =
          std::min(std::abs(lag) / dt_, braking_velocity(std::abs(lag), limits_.a_max[i], dt_));
      advance(i, stream + std::copysign(approach, lag));
    }
    target_[i] = end;
    stream_[i] = stream;
    limited = limited || std::abs(q_[i] - asked) > 1e-9;  // below an encoder's increment
  }
  return limited;
}

void SetpointLimiter::rest() noexcept {
  v_.setZero();
  a_.setZero();
  stream_.setZero();
  target_ = q_;
}

void SetpointLimiter::coast(int cycles) {
  for (Eigen::Index i = 0; i < q_.size(); ++i) {
    const double way = cycles * dt_ * v_[i];
    q_[i] += way;
    target_[i] += way;
  }
}

void SetpointLimiter::hold() {
  for (Eigen::Index i = 0; i < q_.size(); ++i) advance(i, 0.0);
  target_ = q_;
  stream_.setZero();
}

void PhasedActuators::enter(Phase phase) {
  reading_.phase = phase;
  entered_ = now_;
  if (phase != Phase::fault && phase != Phase::starting) reading_.reason.clear();
}

void PhasedActuators::fault(const std::string& why) {
  if (reading_.phase == Phase::fault && !reading_.reason.empty()) return;
  may_enable_ = false;
  enter(Phase::fault);
  reading_.reason = why;
}

void PhasedActuators::obey(const Setpoint& setpoint, bool ready) {
  switch (reading_.phase) {
    case Phase::idle:
    case Phase::holding:
    case Phase::fault:
      if (setpoint.mode != Mode::follow) {
        may_enable_ = true;
      } else if (may_enable_ && ready && reading_.posture_known) {
        enter(Phase::enabling);
      }
      return;
    case Phase::enabling:
      if (setpoint.mode == Mode::idle) enter(Phase::stopping);
      return;
    case Phase::following:
      limiter_.coast(setpoint.missed);
      if (setpoint.mode == Mode::idle) {
        enter(Phase::stopping);
      } else if (setpoint.mode == Mode::hold) {
        limiter_.hold();
      } else {
        reading_.limited += limiter_.follow(setpoint.position_rad, setpoint.brakes) ? 1 : 0;
      }
      return;
    case Phase::starting:
    case Phase::stopping:
      return;
  }
}

}  // namespace mimesis::hw
