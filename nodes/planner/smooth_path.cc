#include "nodes/planner/smooth_path.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::planner {
namespace {

constexpr int kHalvings = 6;

Eigen::MatrixXd corner(const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                       const Eigen::VectorXd& c) {
  Eigen::MatrixXd control(b.size(), 5);
  control << a, 0.5 * (a + b), b, 0.5 * (b + c), c;
  return control;
}

}  // namespace

SmoothPath::SmoothPath(const std::vector<Eigen::VectorXd>& waypoints, double max_radius,
                       const Accept& accept)
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
    for (int halving = 0; halving <= kHalvings && !rounded; ++halving) {
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
