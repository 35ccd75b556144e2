#include "nodes/planner/time_scaling.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "common/math/path_pace.h"

namespace mimesis::planner {
namespace {

constexpr double kGridStep = 0.01;  // largest Δs [rad]
constexpr int kLeastPerPiece = 12;  // grid points in a piece, however short
constexpr int kBisections = 24;
constexpr double kTiny = 1e-12;

struct Interval {
  double lo = -std::numeric_limits<double>::infinity();
  double hi = std::numeric_limits<double>::infinity();
  bool empty() const { return lo > hi + kTiny; }
  /// Adds lower ≤ slope · u ≤ upper.
  void cut(double slope, double lower, double upper) {
    if (std::abs(slope) < kTiny) {
      if (lower > kTiny || upper < -kTiny) hi = lo - 1.0;
      return;
    }
    if (slope < 0.0) std::swap(lower, upper);
    lo = std::max(lo, lower / slope);
    hi = std::min(hi, upper / slope);
  }
};

/// On the stack, unlike VectorXd.
using Rates = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, BatchChecker::kMostJoints, 1>;

struct GridPoint {
  double s = 0.0;
  Rates dq, ddq;
  double bend = 0.0;   // |q''|
  double x_max = 0.0;  // by the velocity limits; 0 where the motion stops
};

std::vector<GridPoint> grid_of(const SmoothPath& path, const Eigen::VectorXd& v_max,
                               const Interrupt& interrupt) {
  std::vector<GridPoint> grid;
  const auto add = [&](double s) {
    SmoothPath::Point point = path.at(s);
    const double rate = (point.dq.cwiseAbs().array() / v_max.array()).maxCoeff();
    const bool stop = std::any_of(path.stops().begin(), path.stops().end(),
                                  [s](double at) { return std::abs(at - s) < kTiny; });
    const double x_max = stop ? 0.0 : 1.0 / std::max(rate * rate, kTiny);
    grid.push_back({s, point.dq, point.ddq, point.ddq.norm(), x_max});
  };
  add(0.0);
  for (std::size_t k = 1; k < path.knots().size(); ++k) {
    const double begin = path.knots()[k - 1], end = path.knots()[k];
    const int parts =
        std::max(kLeastPerPiece, static_cast<int>(std::ceil((end - begin) / kGridStep)));
    for (int i = 1; i < parts && !interrupt.now(); ++i) add(begin + (end - begin) * i / parts);
    add(end);
  }
  return grid;
}

/// Accelerations u that may be applied from `here` to `there` at squared speed x, if the squared
/// speed at `there` shall stay within [0, x_there].
Interval accelerations(const GridPoint& here, const GridPoint& there, double x, double x_there,
                       const Eigen::VectorXd& a_max) {
  const double twice = 2.0 * (there.s - here.s);
  Interval u;
  u.cut(twice, -x, x_there - x);
  for (Eigen::Index j = 0; j < a_max.size(); ++j) {
    const double drift = here.ddq[j] * x, drift_there = there.ddq[j] * x;
    u.cut(here.dq[j], -a_max[j] - drift, a_max[j] - drift);
    u.cut(there.dq[j] + there.ddq[j] * twice, -a_max[j] - drift_there, a_max[j] - drift_there);
  }
  return u;
}

std::vector<double> x_max_of(const std::vector<GridPoint>& grid) {
  std::vector<double> x_max;
  for (const GridPoint& point : grid) x_max.push_back(point.x_max);
  return x_max;
}

/// Largest squared speed at every grid point from which the rest can be driven.
std::vector<double> controllable(const std::vector<GridPoint>& grid,
                                 const std::vector<double>& x_max, const Eigen::VectorXd& a_max,
                                 const Interrupt& interrupt) {
  std::vector<double> x(grid.size(), 0.0);
  for (std::size_t i = grid.size() - 1; i-- > 0 && !interrupt.now();) {
    const auto feasible = [&](double value) {
      return !accelerations(grid[i], grid[i + 1], value, x[i + 1], a_max).empty();
    };
    double lo = 0.0, hi = x_max[i];
    if (feasible(hi)) lo = hi;
    for (int b = 0; b < kBisections && hi > lo; ++b) {
      const double middle = 0.5 * (lo + hi);
      (feasible(middle) ? lo : hi) = middle;
    }
    x[i] = lo;
  }
  return x;
}

/// ṡ at the grid points of the fastest motion.
std::vector<double> fastest(const std::vector<GridPoint>& grid, const std::vector<double>& x_max,
                            const Eigen::VectorXd& a_max, const Interrupt& interrupt) {
  const std::vector<double> limit = controllable(grid, x_max, a_max, interrupt);
  std::vector<double> speed(grid.size(), 0.0);
  for (std::size_t i = 0; i + 1 < grid.size() && !interrupt.now(); ++i) {
    const double x = speed[i] * speed[i], ds = grid[i + 1].s - grid[i].s;
    const Interval u = accelerations(grid[i], grid[i + 1], x, limit[i + 1], a_max);
    speed[i + 1] = std::sqrt(std::clamp(x + 2.0 * u.hi * ds, 0.0, limit[i + 1]));
  }
  return speed;
}

/// The way that the motion has gone within a time before a grid point, and the largest q'' there.
struct Behind {
  double way = 0.0, bend = 0.0;
  bool stop = false;  // it stood meanwhile, at a corner that it keeps
};

Behind behind(const std::vector<GridPoint>& grid, const std::vector<double>& speed, std::size_t i,
              double time_s) {
  Behind past;
  for (; i > 0 && time_s > 0.0; --i) {
    past.bend = std::max({past.bend, grid[i].bend, grid[i - 1].bend});
    past.stop = past.stop || grid[i].x_max == 0.0;
    const double ds = grid[i].s - grid[i - 1].s, sum = speed[i] + speed[i - 1];
    const double u = (speed[i] * speed[i] - speed[i - 1] * speed[i - 1]) / (2.0 * ds);
    if (sum * time_s <= 2.0 * ds) {
      past.way += (speed[i] - 0.5 * u * time_s) * time_s;
      break;
    }
    past.way += ds;
    time_s -= 2.0 * ds / sum;
  }
  return past;
}

/// The speed at grid point i + 1 is at most what is reached from i: after a slower stretch it is
/// still below the limit there.
void reach_next(const std::vector<GridPoint>& grid, const Eigen::VectorXd& a_max, std::size_t i,
                std::vector<double>& speed) {
  const double ds = grid[i + 1].s - grid[i].s, x = speed[i] * speed[i];
  const Interval u = accelerations(grid[i], grid[i + 1], x, speed[i + 1] * speed[i + 1], a_max);
  if (!u.empty())
    speed[i + 1] = std::min(speed[i + 1], std::sqrt(std::max(0.0, x + 2.0 * u.hi * ds)));
}

/// The stops that begin between grid points i and `end` at the speed s_dot or slower; what is
/// between them is on a line.
/// @param speed  at the grid points up to `end`
Stops stops_between(const SmoothPath& path, const std::vector<GridPoint>& grid,
                    const std::vector<double>& speed, std::size_t i, std::size_t end, double s_dot,
                    double alone_s) {
  const double ds = grid[end].s - grid[i].s;
  Stops stops;
  stops.q0 = path.at(grid[i].s).q;
  stops.q1 = path.at(grid[end].s).q;
  stops.bow_rad = std::max(grid[i].bend, grid[end].bend) * ds * ds / 8.0;
  stops.v1 = s_dot * grid[end].dq;
  // A line may begin at a kept corner, where q' is that of the line before.
  stops.v0 = stops.bow_rad == 0.0 ? stops.v1 : Eigen::VectorXd(s_dot * grid[i].dq);
  stops.pieces = static_cast<int>(end - i);
  if (alone_s == 0.0) return stops;
  Behind past = behind(grid, speed, i, alone_s);
  for (std::size_t k = i + 1; k <= end; ++k) {
    const Behind one = behind(grid, speed, k, alone_s);
    past.way = std::max(past.way, one.way);
    past.bend = std::max(past.bend, one.bend);
  }
  stops.before0 = path.at(std::max(0.0, grid[i].s - past.way)).q;
  stops.before1 = grid[i].s < past.way ? stops.before0 : path.at(grid[end].s - past.way).q;
  stops.before_bow_rad = past.stop ? past.way : past.bend * (past.way + ds) * (past.way + ds) / 8.0;
  return stops;
}

/// The last grid point that is on a line with i and all between, `most` pieces of it at most.
std::size_t end_of_line(const std::vector<GridPoint>& grid, std::size_t i, std::size_t most) {
  std::size_t end = i + 1;
  const bool line = grid[i].bend == 0.0 && grid[end].bend == 0.0;
  while (line && end - i < most && end + 1 < grid.size() && grid[end].x_max > 0.0 &&
         grid[end + 1].bend == 0.0)
    ++end;
  return end;
}

/// Lowers x_max where the motion could not be stopped at `speed`, which is the fastest. False if no
/// speed is low enough, or interrupted.
/// @param most_pieces  of a line whose stops are asked for at once, where they are soon proven
bool slow_down(const SmoothPath& path, std::vector<double> speed, const Eigen::VectorXd& a_max,
               const Stoppable& stoppable, double alone_s, std::size_t most_pieces,
               std::vector<GridPoint>& grid, const Interrupt& interrupt) {
  constexpr double kSlowerBy = 0.85, kLeast_rad_s = 0.01;
  std::size_t pieces = most_pieces, alone = 0, wait = 1;
  for (std::size_t i = 0; i + 1 < grid.size();) {
    const std::size_t end = end_of_line(grid, i, pieces);
    std::vector<double> now = speed;
    for (std::size_t k = i; k < end; ++k) reach_next(grid, a_max, k, now);
    double s_dot = 0.0;
    for (std::size_t k = i; k <= end; ++k) s_dot = std::max(s_dot, now[k]);
    const auto keep = [&] {
      for (std::size_t k = i; k <= end; ++k) {
        speed[k] = std::min(now[k], s_dot);
        grid[k].x_max = std::min(grid[k].x_max, speed[k] * speed[k]);
      }
    };
    if (end > i + 1) {
      const Stops stops = stops_between(path, grid, now, i, end, s_dot, alone_s);
      if (stops.before_bow_rad > 0.0 || !stoppable(stops)) {
        pieces = (end - i) / 2;
        continue;
      }
      keep();
      i = end;
      pieces = std::min(2 * pieces, most_pieces);
      wait = 1;
      continue;
    }
    for (keep(); !stoppable(stops_between(path, grid, speed, i, end, s_dot, alone_s)); keep()) {
      if (s_dot < kLeast_rad_s || interrupt.now()) return false;
      s_dot *= kSlowerBy;
      now = speed;
    }
    i = end;
    // Near obstacles several at once are tried more and more rarely.
    if (++alone < wait || most_pieces == 1) continue;
    pieces = 2;
    alone = 0;
    wait = std::min(2 * wait, most_pieces);
  }
  return true;
}

/// s over time at the speeds of the grid, each part between two stops averaged over `window_s`.
class PathClock {
 public:
  /// @param x_max  0 where it stops
  PathClock(const std::vector<GridPoint>& grid, const std::vector<double>& x_max,
            const std::vector<double>& speed, double window_s)
      : grid_(grid), speed_(speed), window_(window_s), time_(grid.size(), 0.0), way_(time_) {
    parts_.push_back({0, 0, 0.0});
    for (std::size_t i = 0; i + 1 < grid.size(); ++i) {
      const double ds = grid[i + 1].s - grid[i].s;
      const double dt = 2.0 * ds / std::max(speed[i] + speed[i + 1], kTiny);
      time_[i + 1] = time_[i] + dt;
      way_[i + 1] = way_[i] + dt * (grid[i].s + dt * (2.0 * speed[i] + speed[i + 1]) / 6.0);
      parts_.back().last = i + 1;
      if (x_max[i + 1] == 0.0 && i + 2 < grid.size())
        parts_.push_back(
            {i + 1, i + 1,
             parts_.back().begin + window_s + time_[i + 1] - time_[parts_.back().first]});
    }
  }
  double duration() const {
    return parts_.back().begin + time_.back() - time_[parts_.back().first] + window_;
  }
  /// s and ṡ.
  std::pair<double, double> at(double t) const {
    const Part& part = part_of(t);
    const double since = time_[part.first] + t - part.begin;
    if (window_ == 0.0) return {place(part, since), rate(part, since)};
    return {(way(part, since) - way(part, since - window_)) / window_,
            (place(part, since) - place(part, since - window_)) / window_};
  }
  /// The grid points that have an influence on the times from t0 to t1.
  std::pair<std::size_t, std::size_t> influence(double t0, double t1) const {
    const Part& from = part_of(t0);
    const Part& to = part_of(t1);
    return {index(from, time_[from.first] + t0 - from.begin - window_),
            std::min(index(to, time_[to.first] + t1 - to.begin) + 1, grid_.size() - 1)};
  }

 private:
  struct Part {
    std::size_t first, last;  // of the grid
    double begin;             // when it begins, in the time with all windows [s]
  };

  const Part& part_of(double t) const {
    auto part = parts_.begin();
    while (part + 1 != parts_.end() && (part + 1)->begin <= t) ++part;
    return *part;
  }
  /// The grid point before time t of the part.
  std::size_t index(const Part& part, double t) const {
    const auto begin = time_.begin() + static_cast<std::ptrdiff_t>(part.first),
               end = time_.begin() + static_cast<std::ptrdiff_t>(part.last);
    const auto behind = std::upper_bound(begin, end, t);
    return static_cast<std::size_t>(std::max(behind - time_.begin() - 1, begin - time_.begin()));
  }
  double acceleration(std::size_t i) const {
    return (speed_[i + 1] - speed_[i]) / (time_[i + 1] - time_[i]);
  }
  bool rests(const Part& part, double t) const {
    return t <= time_[part.first] || t >= time_[part.last];
  }
  double rate(const Part& part, double t) const {
    if (rests(part, t)) return 0.0;
    const std::size_t i = index(part, t);
    return speed_[i] + acceleration(i) * (t - time_[i]);
  }
  double place(const Part& part, double t) const {
    if (rests(part, t)) return grid_[t <= time_[part.first] ? part.first : part.last].s;
    const std::size_t i = index(part, t);
    const double tau = t - time_[i];
    return grid_[i].s + (speed_[i] + 0.5 * acceleration(i) * tau) * tau;
  }
  /// ∫ s dt
  double way(const Part& part, double t) const {
    const std::size_t i = t <= time_[part.first]  ? part.first
                          : t >= time_[part.last] ? part.last
                                                  : index(part, t);
    const double tau = t - time_[i];
    if (rests(part, t)) return way_[i] + grid_[i].s * tau;
    return way_[i] + tau * (grid_[i].s + tau * (speed_[i] / 2.0 + acceleration(i) * tau / 6.0));
  }

  const std::vector<GridPoint>& grid_;
  const std::vector<double>& speed_;
  double window_;
  std::vector<double> time_, way_;
  std::vector<Part> parts_;
};

JointTrajectory sampled(const SmoothPath& path, const PathClock& clock, double stretch,
                        double period_s, const Interrupt& interrupt) {
  const double duration = stretch * clock.duration();
  const auto periods =
      static_cast<Eigen::Index>(std::max(1.0, std::ceil(duration / period_s - 1e-9)));
  stretch = period_s * static_cast<double>(periods) / clock.duration();
  JointTrajectory motion{period_s, Eigen::MatrixXd(path.dof(), periods + 1),
                         Eigen::MatrixXd::Zero(path.dof(), periods + 1)};
  motion.position.col(0) = path.at(0.0).q;
  for (Eigen::Index k = 1; k < periods && !interrupt.now(); ++k) {
    const auto [s, s_dot] = clock.at(static_cast<double>(k) * period_s / stretch);
    const SmoothPath::Point point = path.at(std::clamp(s, 0.0, path.length()));
    motion.position.col(k) = point.q;
    motion.velocity.col(k) = point.dq * (s_dot / stretch);
  }
  motion.position.col(periods) = path.at(path.length()).q;
  return motion;
}

struct Limits {
  Eigen::VectorXd v, a, j;
};

constexpr double kTolerance = 1.01;            // of the time
constexpr double kStrict = kTolerance - 1e-9;  // makes a limit one without tolerance

/// By how much the differences of the samples around each are beyond the limits, and its speed
/// beyond what can be stopped, in time: the motion keeps them if it takes so much longer. The arm
/// rests before and behind the motion.
std::vector<double> excess(const JointTrajectory& motion, const PathClock& clock,
                           const std::vector<GridPoint>& grid, const Limits& limits,
                           const Interrupt& interrupt) {
  const Eigen::Index count = motion.samples();
  const double pace = clock.duration() / motion.duration_s();
  const auto q = [&](Eigen::Index k) {
    return motion.position.col(std::clamp(k, Eigen::Index{0}, count - 1));
  };
  const auto share = [&](const auto& difference, const Eigen::VectorXd& most) {
    return (difference.array().abs() / most.array()).maxCoeff();
  };
  std::vector<double> beyond;
  std::size_t i = 0;
  for (Eigen::Index k = 0; k < count && !interrupt.now(); ++k) {
    const double v = share(motion.velocity.col(k), limits.v);
    const double a = share(q(k + 1) - 2.0 * q(k) + q(k - 1), limits.a);
    const double j = share(q(k + 2) - 3.0 * q(k + 1) + 3.0 * q(k) - q(k - 1), limits.j);
    const auto [s, s_dot] = clock.at(static_cast<double>(k) * motion.period_s * pace);
    while (i + 2 < grid.size() && grid[i + 1].s < s) ++i;
    const double stoppable = std::sqrt(std::max({grid[i].x_max, grid[i + 1].x_max, kTiny}));
    beyond.push_back(std::max({v, std::sqrt(a) / motion.period_s, std::cbrt(j) / motion.period_s,
                               kStrict * s_dot * pace / stoppable}));
  }
  return beyond;
}

/// The motion with these limits of the acceleration: see time_optimal. Empty if interrupted.
JointTrajectory smoothed(const SmoothPath& path, const std::vector<GridPoint>& grid,
                         const Limits& limits, double period_s, const Interrupt& interrupt) {
  constexpr int kMostRounds = 20, kPatience = 4;
  constexpr double kBetter = 0.998;
  const double window = (limits.a.array() / limits.j.array()).maxCoeff();
  std::vector<double> x_max = x_max_of(grid);
  std::optional<JointTrajectory> best;
  std::vector<double> cap(grid.size());
  for (int round = 0, since = 0; round < kMostRounds && since < kPatience; ++round) {
    const std::vector<double> speed = fastest(grid, x_max, limits.a, interrupt);
    if (interrupt.told()) return {};
    const PathClock clock(grid, x_max, speed, window);
    JointTrajectory motion = sampled(path, clock, 1.0, period_s, interrupt);
    const double h = period_s * clock.duration() / motion.duration_s();
    const std::vector<double> beyond = excess(motion, clock, grid, limits, interrupt);
    if (interrupt.told()) return {};
    const double worst = *std::ranges::max_element(beyond);
    double still = worst;
    for (double stretch = worst; still > kTolerance; stretch *= still) {
      motion = sampled(path, clock, stretch, period_s, interrupt);
      const std::vector<double> left = excess(motion, clock, grid, limits, interrupt);
      if (interrupt.told()) return {};
      still = std::ranges::max(left);
    }
    const bool better = !best || motion.duration_s() < kBetter * best->duration_s();
    since = better ? 0 : since + 1;
    if (!best || motion.samples() < best->samples()) best = std::move(motion);
    if (worst <= kTolerance) break;
    std::ranges::fill(cap, std::numeric_limits<double>::infinity());
    for (std::size_t k = 0; k < beyond.size() && !interrupt.now(); ++k) {
      if (beyond[k] <= kTolerance) continue;
      const double t = static_cast<double>(k) * h, r = beyond[k] + 0.2 * (beyond[k] - 1.0);
      const auto [from, to] = clock.influence(std::max(t - h, 0.0), t + 2.0 * h);
      const auto [lo, hi] =
          std::minmax_element(speed.begin() + static_cast<std::ptrdiff_t>(from),
                              speed.begin() + static_cast<std::ptrdiff_t>(to) + 1);
      const double flat = 0.995 * *hi;  // what is not, is made flat first
      const double cut = *lo < flat ? *lo + (*hi - *lo) / (r * r * r) : *hi / r;
      for (std::size_t p = from; p <= to; ++p) cap[p] = std::min(cap[p], cut);
    }
    for (std::size_t p = 0; p < grid.size(); ++p) x_max[p] = std::min(x_max[p], cap[p] * cap[p]);
  }
  return *best;
}

JointTrajectory timed(const SmoothPath& path, const std::vector<GridPoint>& grid,
                      const Limits& limits, double period_s, const Interrupt& interrupt) {
  if (limits.j.size() == 0) {
    const std::vector<double> x_max = x_max_of(grid),
                              speed = fastest(grid, x_max, limits.a, interrupt);
    if (interrupt.told()) return {};
    return sampled(path, PathClock(grid, x_max, speed, 0.0), 1.0, period_s, interrupt);
  }
  JointTrajectory best = smoothed(path, grid, limits, period_s, interrupt);
  double share = 1.0;
  for (const double factor : {0.7, 0.85, 1.15}) {
    while (share * factor < 1.0 && !interrupt.told()) {
      JointTrajectory other = smoothed(path, grid, {limits.v, share * factor * limits.a, limits.j},
                                       period_s, interrupt);
      if (other.samples() >= best.samples()) break;
      best = std::move(other);
      share *= factor;
    }
  }
  return best;
}

}  // namespace

std::optional<JointTrajectory> time_optimal(const SmoothPath& path,
                                            const Eigen::VectorXd& v_max_rad_s,
                                            const Eigen::VectorXd& a_max_rad_s2, double period_s,
                                            const Stoppable& stoppable, double alone_s,
                                            const Eigen::VectorXd& j_max_rad_s3,
                                            const Interrupt& interrupt, std::size_t most_pieces) {
  std::vector<GridPoint> grid = grid_of(path, v_max_rad_s, interrupt);
  if (!slow_down(path, fastest(grid, x_max_of(grid), a_max_rad_s2, interrupt), a_max_rad_s2,
                 stoppable, alone_s, most_pieces, grid, interrupt))
    return std::nullopt;
  JointTrajectory motion =
      timed(path, grid, {v_max_rad_s, a_max_rad_s2, j_max_rad_s3}, period_s, interrupt);
  if (interrupt.told()) return std::nullopt;
  return motion;
}

JointTrajectory time_optimal(const SmoothPath& path, const Eigen::VectorXd& v_max_rad_s,
                             const Eigen::VectorXd& a_max_rad_s2, double period_s,
                             const Eigen::VectorXd& j_max_rad_s3) {
  return timed(path, grid_of(path, v_max_rad_s, {}), {v_max_rad_s, a_max_rad_s2, j_max_rad_s3},
               period_s, {});
}

void Playback::start(JointTrajectory trajectory) {
  trajectory_ = std::make_shared<const JointTrajectory>(std::move(trajectory));
  at_ = 0.0;
  pace_ = 1.0;
  wanted_ = 1.0;
}

void Playback::advance() {
  if (at_rest()) return;
  const double period = trajectory_->period_s;
  if (pace_ != wanted_) {
    // Accelerations jump from one sample to the next: those around count.
    const auto& v = trajectory_->velocity;
    const Eigen::Index here = sample().first, last = std::min(here + 1, v.cols() - 2);
    double lowest = -std::numeric_limits<double>::infinity(), highest = -lowest;
    for (Eigen::Index k = std::max(here - 1, Eigen::Index{0}); k <= last; ++k) {
      const auto rates =
          math::pace_rates(v.col(here), (v.col(k + 1) - v.col(k)) / period, pace_, a_max_);
      lowest = std::max(lowest, rates.lowest);
      highest = std::min(highest, rates.highest);
    }
    pace_ = std::min(std::max(wanted_, pace_ + lowest * period), pace_ + highest * period);
  }
  at_ = std::min(at_ + pace_ * period, trajectory_->duration_s());
}

Eigen::MatrixXd Playback::ahead(Eigen::Index periods) const {
  Eigen::MatrixXd positions(trajectory_->position.rows(), periods);
  Playback later = *this;
  Eigen::Index k = 0;
  for (; k < periods && !later.at_rest(); ++k) {
    later.advance();
    positions.col(k) = later.position();
  }
  return positions.leftCols(k);
}

std::pair<Eigen::Index, double> Playback::sample() const {
  // Whole periods come out exactly: without braking every sample is played as planned.
  const double periods = at_ / trajectory_->period_s, whole = std::floor(periods + 1e-6);
  const auto k = std::min(static_cast<Eigen::Index>(whole), trajectory_->samples() - 1);
  return {k, std::max(0.0, periods - static_cast<double>(k))};
}

Eigen::VectorXd Playback::position() const {
  const auto& [h, q, dq] = *trajectory_;
  const auto [k, u] = sample();
  if (u < 1e-6 || k + 1 >= q.cols()) return q.col(k);
  // Cubic Hermite between the samples.
  const double v = 1.0 - u;
  return (1.0 + 2.0 * u) * v * v * q.col(k) + u * u * (3.0 - 2.0 * u) * q.col(k + 1) +
         h * u * v * v * dq.col(k) - h * u * u * v * dq.col(k + 1);
}

Eigen::VectorXd Playback::velocity() const {
  const auto& dq = trajectory_->velocity;
  const auto [k, u] = sample();
  if (at_rest()) return Eigen::VectorXd::Zero(dq.rows());
  if (u < 1e-6 || k + 1 >= dq.cols()) return pace_ * dq.col(k);
  return pace_ * ((1.0 - u) * dq.col(k) + u * dq.col(k + 1));
}

}  // namespace mimesis::planner
