#include "nodes/planner/smooth_path.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <span>

#include "common/error.h"

namespace mimesis::planner {
namespace {

using Waypoints = std::vector<Eigen::VectorXd>;

/// From each waypoint to the farthest later one that can be reached straight.
Waypoints without_detours(const Waypoints& path, const Certify& certify) {
  Waypoints kept{path.front()};
  for (std::size_t i = 0; i + 1 < path.size();) {
    std::size_t j = path.size() - 1;
    while (j > i + 1 && !certify(path[i], path[j])) --j;
    kept.push_back(path[j]);
    i = j;
  }
  return kept;
}

struct Spot {
  std::size_t part = 0;  // between waypoints part and part + 1
  Eigen::VectorXd q;
};

Spot spot_at(const Waypoints& path, double length) {
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double part = (path[i + 1] - path[i]).norm();
    if (length <= part || i + 2 == path.size()) {
      const double u = std::clamp(length / part, 0.0, 1.0);
      return {i, (1.0 - u) * path[i] + u * path[i + 1]};
    }
    length -= part;
  }
  return {0, path.front()};
}

double length_of(const Waypoints& path) {
  double sum = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) sum += (path[i] - path[i - 1]).norm();
  return sum;
}

Waypoints without_doubles(const Waypoints& path) {
  Waypoints kept{path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    if ((path[i] - kept.back()).norm() > 1e-6) kept.push_back(path[i]);
  }
  if (kept.size() > 1) kept.back() = path.back();
  return kept;
}

struct Mean {
  Eigen::VectorXd sum;
  int count = 0;
};

Mean mean_in_window(const Eigen::MatrixXd& nodes, std::span<const char> inhibited, char wanted,
                    Eigen::Index center, double window) {
  Mean mean{Eigen::VectorXd::Zero(nodes.rows()), 0};
  for (Eigen::Index j = 0; j < nodes.cols(); ++j) {
    if (j == center || inhibited[static_cast<std::size_t>(j)] != wanted) continue;
    bool inside = true;
    for (Eigen::Index row = 0; row < nodes.rows() && inside; ++row) {
      inside = std::abs(nodes(row, j) - nodes(row, center)) <= window;
    }
    if (!inside) continue;
    mean.sum += nodes.col(j);
    ++mean.count;
  }
  return mean;
}

Eigen::VectorXd shift(const Eigen::MatrixXd& nodes, std::span<const char> inhibited, Eigen::Index i,
                      double window) {
  Eigen::VectorXd v = Eigen::VectorXd::Zero(nodes.rows());
  const Mean others = mean_in_window(nodes, inhibited, 1, i, window);
  const Mean active = mean_in_window(nodes, inhibited, 0, i, window);
  if (others.count > 0) v += nodes.col(i) - others.sum / others.count;
  if (active.count > 0) v += active.sum / active.count - nodes.col(i);
  const double longest = v.cwiseAbs().maxCoeff();
  if (longest > window) v *= window / longest;
  return v;
}

constexpr int kHalvings = 6;

Eigen::MatrixXd corner(const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                       const Eigen::VectorXd& c) {
  Eigen::MatrixXd control(b.size(), 5);
  control << a, 0.5 * (a + b), b, 0.5 * (b + c), c;
  return control;
}

}  // namespace

std::vector<Eigen::VectorXd> shortened(std::vector<Eigen::VectorXd> path, const Certify& certify,
                                       int attempts, std::uint64_t seed,
                                       const Interrupt& interrupt) {
  path = without_doubles(without_detours(path, certify));
  std::mt19937_64 random(seed);
  const auto unit = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };
  for (int i = 0; i < attempts && path.size() > 2 && !interrupt.now(); ++i) {
    const double length = length_of(path);
    const double first = unit() * length, second = unit() * length;
    const Spot a = spot_at(path, std::min(first, second)),
               b = spot_at(path, std::max(first, second));
    if (a.part == b.part || !certify(a.q, b.q)) continue;
    Waypoints next(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(a.part) + 1);
    next.push_back(a.q);
    next.push_back(b.q);
    next.insert(next.end(), path.begin() + static_cast<std::ptrdiff_t>(b.part) + 1, path.end());
    path = without_doubles(next);
  }
  return without_doubles(without_detours(path, certify));
}

std::vector<double> refine_offline(Eigen::MatrixXd& nodes, const Eigen::VectorXd& lo,
                                   const Eigen::VectorXd& hi, const FreePostures& free,
                                   const RefinementSettings& settings, const Interrupt& interrupt) {
  const auto count = static_cast<std::size_t>(nodes.cols());
  const auto judge = [&] {
    std::vector<char> inhibited = free(nodes);
    for (char& one : inhibited) one = !one;
    return inhibited;
  };
  std::vector<char> inhibited = judge();

  std::vector<double> shares;
  for (int iteration = 0;; ++iteration) {
    const auto bad = std::count(inhibited.begin(), inhibited.end(), 1);
    shares.push_back(static_cast<double>(bad) /
                     static_cast<double>(std::max<std::size_t>(count, 1)));
    if (shares.back() < settings.inhibited_share || iteration >= settings.max_iterations ||
        interrupt.told())
      break;
    Eigen::MatrixXd moved = nodes;
    for (Eigen::Index i = 0; i < nodes.cols() && !interrupt.told(); ++i) {
      if (!inhibited[static_cast<std::size_t>(i)] || interrupt.now()) continue;
      moved.col(i) = (nodes.col(i) + shift(nodes, inhibited, i, settings.window_rad))
                         .cwiseMax(lo)
                         .cwiseMin(hi);
    }
    nodes.swap(moved);
    inhibited = judge();
  }

  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < nodes.cols(); ++i) {
    if (!inhibited[static_cast<std::size_t>(i)]) nodes.col(kept++) = nodes.col(i);
  }
  nodes.conservativeResize(Eigen::NoChange, kept);
  return shares;
}

SmoothPath::SmoothPath(const std::vector<Eigen::VectorXd>& waypoints, double max_radius,
                       const Accept& accept, const Interrupt& interrupt)
    : knots_{0.0}, stops_{0.0} {
  MIMESIS_ASSERT(waypoints.size() >= 2);
  Eigen::VectorXd from = waypoints.front();
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    const Eigen::VectorXd& b = waypoints[i];
    if (i + 1 == waypoints.size()) {
      add((Eigen::MatrixXd(b.size(), 2) << from, b).finished(), (b - from).norm());
      break;
    }
    const Eigen::VectorXd in = b - waypoints[i - 1], out = waypoints[i + 1] - b;
    const double in_length = in.norm(), out_length = out.norm();
    double radius = std::min({max_radius, 0.5 * in_length, 0.5 * out_length});
    bool rounded = false;
    for (int halving = 0; halving <= kHalvings && !rounded && !interrupt.told(); ++halving) {
      const Eigen::VectorXd a = b - radius / in_length * in, c = b + radius / out_length * out;
      const Eigen::MatrixXd control = corner(a, b, c);
      if ((rounded = accept(control))) {
        add((Eigen::MatrixXd(b.size(), 2) << from, a).finished(), (a - from).norm());
        add(control, 2.0 * radius);
        from = c;
      } else {
        radius *= 0.5;
      }
    }
    if (!rounded) {
      add((Eigen::MatrixXd(b.size(), 2) << from, b).finished(), (b - from).norm());
      stops_.push_back(knots_.back());
      from = b;
    }
  }
  stops_.push_back(knots_.back());
}

void SmoothPath::add(Eigen::MatrixXd control, double length) {
  if (length < 1e-12) return;  // two corners meet
  pieces_.push_back({knots_.back(), knots_.back() + length, std::move(control)});
  knots_.push_back(pieces_.back().end);
}

SmoothPath::Point SmoothPath::at(double s) const {
  const auto piece =
      std::find_if(pieces_.begin(), pieces_.end() - 1, [s](const Piece& p) { return s <= p.end; });
  const double length = piece->end - piece->begin;
  const double u = std::clamp((s - piece->begin) / length, 0.0, 1.0), w = 1.0 - u;
  const auto& p = piece->control;
  if (p.cols() == 2) {
    return {w * p.col(0) + u * p.col(1), (p.col(1) - p.col(0)) / length,
            Eigen::VectorXd::Zero(p.rows())};
  }
  const Eigen::MatrixXd d = 4.0 * (p.rightCols(4) - p.leftCols(4));
  const Eigen::MatrixXd dd = 3.0 * (d.rightCols(3) - d.leftCols(3));
  return {w * w * w * w * p.col(0) + 4.0 * u * w * w * w * p.col(1) +
              6.0 * u * u * w * w * p.col(2) + 4.0 * u * u * u * w * p.col(3) +
              u * u * u * u * p.col(4),
          (w * w * w * d.col(0) + 3.0 * u * w * w * d.col(1) + 3.0 * u * u * w * d.col(2) +
           u * u * u * d.col(3)) /
              length,
          (w * w * dd.col(0) + 2.0 * u * w * dd.col(1) + u * u * dd.col(2)) / (length * length)};
}

std::vector<Eigen::MatrixXd> SmoothPath::curves() const {
  std::vector<Eigen::MatrixXd> all;
  for (const auto& piece : pieces_) all.push_back(piece.control);
  return all;
}

}  // namespace mimesis::planner
