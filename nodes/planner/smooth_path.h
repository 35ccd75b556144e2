#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

namespace mimesis::planner {

/// Joint path through waypoints with rounded corners, by arc parameter s [rad]; C² but for `stops`.
///
/// Corners are quartic Bézier curves A, (A+B)/2, B, (B+C)/2, C with A and C at distance r before
/// and behind corner B: tangent and (vanishing) curvature meet those of the lines. Where no radius
/// is accepted the path keeps the corner, and the motion must stop there.
class SmoothPath {
 public:
  /// Tells whether a Bézier curve (control points in columns) may be driven.
  using Accept = std::function<bool(const Eigen::MatrixXd& control_points)>;

  /// @param waypoints  at least two, no two successive ones equal; the lines between them may be
  /// driven
  /// @param max_radius largest r [rad]; halved until `accept` agrees, down to 1/64
  SmoothPath(const std::vector<Eigen::VectorXd>& waypoints, double max_radius,
             const Accept& accept);

  struct Point {
    Eigen::VectorXd q, dq, ddq;  ///< q(s), q'(s), q''(s)
  };
  Point at(double s) const;                             ///< 0 ≤ s ≤ length()
  double length() const { return pieces_.back().end; }  ///< [rad]
  int dof() const { return static_cast<int>(pieces_.front().control.rows()); }

  /// Values of s that the motion's grid must contain: ends of pieces. Rising, from 0 to length().
  const std::vector<double>& knots() const { return knots_; }
  /// Where the motion must stop: 0, kept corners, length().
  const std::vector<double>& stops() const { return stops_; }
  /// All pieces, as control points: 2 columns a line, 5 a corner.
  std::vector<Eigen::MatrixXd> curves() const;

 private:
  struct Piece {
    double begin, end;
    Eigen::MatrixXd control;
  };
  void add(Eigen::MatrixXd control, double length);

  std::vector<Piece> pieces_;
  std::vector<double> knots_, stops_;
};

}  // namespace mimesis::planner
