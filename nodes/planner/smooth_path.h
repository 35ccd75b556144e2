#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/interrupt.h"

namespace mimesis::planner {

/// Tells whether the straight motion between two postures is proven free.
using Certify = std::function<bool(const Eigen::VectorXd&, const Eigen::VectorXd&)>;

/// Shortens a path whose parts are certified, keeping its ends and the certificate: first whole
/// detours between waypoints, then `attempts` chords between points drawn from `seed` anywhere on
/// the path. Interrupted, it is less short.
std::vector<Eigen::VectorXd> shortened(std::vector<Eigen::VectorXd> waypoints,
                                       const Certify& certify, int attempts, std::uint64_t seed,
                                       const Interrupt& interrupt = {});

struct RefinementSettings {
  double window_rad =
      1.3;  ///< half side of the testing window, about the range of the obstacles [rad]
  double inhibited_share = 0.02;  ///< stop below this share of inhibited nodes [1]
  int max_iterations = 30;        ///< [1]
};

/// Tells of every column whether it is free.
using FreePostures = std::function<std::vector<char>(const Eigen::MatrixXd&)>;

/// Off-line refinement [M18 2.3.2, fig. 2.9, 2.10]: inhibited nodes move out of the obstacles and
/// gather at their borders. Each inhibited node moves by v₁ = v₂ + v₃, with v₂ from the mean of the
/// other inhibited nodes to the node and v₃ from the node to the mean of the active nodes (0 if
/// there are none), over a testing window. The thesis slides the window over the whole space; here
/// every inhibited node has the window centred at it, which is the same mean without the grid of
/// positions. All nodes move at once; those that are still inhibited at the end are dropped. Nodes
/// stay within [lo, hi].
/// @returns the share of inhibited nodes before each iteration and at the end, before the drop [1]
std::vector<double> refine_offline(Eigen::MatrixXd& nodes, const Eigen::VectorXd& lo,
                                   const Eigen::VectorXd& hi, const FreePostures& free,
                                   const RefinementSettings& settings,
                                   const Interrupt& interrupt = {});

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
  /// Interrupted, it keeps the corners that are left.
  SmoothPath(const std::vector<Eigen::VectorXd>& waypoints, double max_radius, const Accept& accept,
             const Interrupt& interrupt = {});

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
