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
constexpr int kBisections = 45;
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

struct GridPoint {
  double s = 0.0;
  Eigen::VectorXd dq, ddq;
  double x_max = 0.0;  // by the velocity limits; 0 where the motion stops
};

std::vector<GridPoint> grid_of(const SmoothPath& path, const Eigen::VectorXd& v_max) {
  std::vector<GridPoint> grid;
  const auto add = [&](double s) {
    SmoothPath::Point point = path.at(s);
    const double rate = (point.dq.cwiseAbs().array() / v_max.array()).maxCoeff();
    const bool stop = std::any_of(path.stops().begin(), path.stops().end(),
                                  [s](double at) { return std::abs(at - s) < kTiny; });
    const double x_max = stop ? 0.0 : 1.0 / std::max(rate * rate, kTiny);
    grid.push_back({s, std::move(point.dq), std::move(point.ddq), x_max});
  };
  add(0.0);
  for (std::size_t k = 1; k < path.knots().size(); ++k) {
    const double begin = path.knots()[k - 1], end = path.knots()[k];
    const int parts =
        std::max(kLeastPerPiece, static_cast<int>(std::ceil((end - begin) / kGridStep)));
    for (int i = 1; i < parts; ++i) add(begin + (end - begin) * i / parts);
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

/// Largest squared speed at every grid point from which the rest can be driven.
std::vector<double> controllable(const std::vector<GridPoint>& grid, const Eigen::VectorXd& a_max) {
  std::vector<double> x(grid.size(), 0.0);
  for (std::size_t i = grid.size() - 1; i-- > 0;) {
    const auto feasible = [&](double value) {
      return !accelerations(grid[i], grid[i + 1], value, x[i + 1], a_max).empty();
    };
    double lo = 0.0, hi = grid[i].x_max;
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
std::vector<double> fastest(const std::vector<GridPoint>& grid, const Eigen::VectorXd& a_max) {
  const std::vector<double> limit = controllable(grid, a_max);
  std::vector<double> speed(grid.size(), 0.0);
  for (std::size_t i = 0; i + 1 < grid.size(); ++i) {
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
    past.bend = std::max({past.bend, grid[i].ddq.norm(), grid[i - 1].ddq.norm()});
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

/// Lowers x_max where the motion could not be stopped at `speed`, which is the fastest. False if no
/// speed is low enough.
bool slow_down(const SmoothPath& path, std::vector<double> speed, const Eigen::VectorXd& a_max,
               const Stoppable& stoppable, double alone_s, std::vector<GridPoint>& grid) {
  constexpr double kSlower = 0.85, kLeast_rad_s = 0.01;
  Stops stops;
  stops.q1 = path.at(0.0).q;
  for (std::size_t i = 0; i + 1 < grid.size(); ++i) {
    const double ds = grid[i + 1].s - grid[i].s;
    // What had to be slower before is not yet as fast here.
    const double x = speed[i] * speed[i];
    const Interval u = accelerations(grid[i], grid[i + 1], x, speed[i + 1] * speed[i + 1], a_max);
    if (!u.empty())
      speed[i + 1] = std::min(speed[i + 1], std::sqrt(std::max(0.0, x + 2.0 * u.hi * ds)));
    stops.q0 = stops.q1;
    stops.q1 = path.at(grid[i + 1].s).q;
    stops.bow_rad = std::max(grid[i].ddq.norm(), grid[i + 1].ddq.norm()) * ds * ds / 8.0;
    for (double s_dot = std::max(speed[i], speed[i + 1]);; s_dot *= kSlower) {
      stops.v1 = s_dot * grid[i + 1].dq;
      // A line may begin at a kept corner, where q' is that of the line before.
      stops.v0 = stops.bow_rad == 0.0 ? stops.v1 : Eigen::VectorXd(s_dot * grid[i].dq);
      for (const std::size_t k : {i, i + 1}) {
        speed[k] = std::min(speed[k], s_dot);
        grid[k].x_max = std::min(grid[k].x_max, speed[k] * speed[k]);
      }
      if (alone_s > 0.0) {
        const Behind one = behind(grid, speed, i, alone_s),
                     two = behind(grid, speed, i + 1, alone_s);
        const double way = std::max(one.way, two.way);
        stops.before0 = path.at(std::max(0.0, grid[i].s - way)).q;
        stops.before1 = grid[i].s < way ? stops.before0 : path.at(grid[i + 1].s - way).q;
        stops.before_bow_rad =
            one.stop ? way : std::max(one.bend, two.bend) * (way + ds) * (way + ds) / 8.0;
      }
      if (stoppable(stops)) break;
      if (s_dot < kLeast_rad_s) return false;
    }
  }
  return true;
}

JointTrajectory sampled(const SmoothPath& path, const std::vector<GridPoint>& grid,
                        const std::vector<double>& speed, double period_s) {
  std::vector<double> time(grid.size(), 0.0);
  for (std::size_t i = 0; i + 1 < grid.size(); ++i) {
    const double ds = grid[i + 1].s - grid[i].s;
    time[i + 1] = time[i] + 2.0 * ds / std::max(speed[i] + speed[i + 1], kTiny);
  }
  const auto periods =
      static_cast<Eigen::Index>(std::max(1.0, std::ceil(time.back() / period_s - 1e-9)));
  const double stretch = period_s * static_cast<double>(periods) / time.back();
  JointTrajectory motion{period_s, Eigen::MatrixXd(path.dof(), periods + 1),
                         Eigen::MatrixXd::Zero(path.dof(), periods + 1)};
  motion.position.col(0) = path.at(0.0).q;
  std::size_t i = 0;
  for (Eigen::Index k = 1; k < periods; ++k) {
    const double t = static_cast<double>(k) * period_s / stretch;
    while (i + 2 < grid.size() && time[i + 1] < t) ++i;
    const double span = time[i + 1] - time[i], tau = std::clamp(t - time[i], 0.0, span);
    const double u = (speed[i + 1] - speed[i]) / span, s_dot = speed[i] + u * tau;
    const double s = grid[i].s + (speed[i] + 0.5 * u * tau) * tau;
    const SmoothPath::Point point = path.at(std::min(s, path.length()));
    motion.position.col(k) = point.q;
    motion.velocity.col(k) = point.dq * (s_dot / stretch);
  }
  motion.position.col(periods) = path.at(path.length()).q;
  return motion;
}

}  // namespace

std::optional<JointTrajectory> time_optimal(const SmoothPath& path,
                                            const Eigen::VectorXd& v_max_rad_s,
                                            const Eigen::VectorXd& a_max_rad_s2, double period_s,
                                            const Stoppable& stoppable, double alone_s) {
  std::vector<GridPoint> grid = grid_of(path, v_max_rad_s);
  if (!slow_down(path, fastest(grid, a_max_rad_s2), a_max_rad_s2, stoppable, alone_s, grid))
    return std::nullopt;
  return sampled(path, grid, fastest(grid, a_max_rad_s2), period_s);
}

JointTrajectory time_optimal(const SmoothPath& path, const Eigen::VectorXd& v_max_rad_s,
                             const Eigen::VectorXd& a_max_rad_s2, double period_s) {
  const std::vector<GridPoint> grid = grid_of(path, v_max_rad_s);
  return sampled(path, grid, fastest(grid, a_max_rad_s2), period_s);
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
