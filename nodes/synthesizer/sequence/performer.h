#pragma once
#include <Eigen/LU>
#include <functional>

#include "nodes/synthesizer/character/smooth.h"
#include "nodes/synthesizer/sequence/limbs.h"
#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {

/// Twice continuously differentiable curve through knots with given slopes at both ends; constant
/// slope before the first, constant value after the last knot (so end with slope 0).
class SmoothCurve {
 public:
  /// Times must rise; at least two knots.
  SmoothCurve(std::vector<double> times, std::vector<double> values, double slope_first,
              double slope_last)
      : t_(std::move(times)), x_(std::move(values)) {
    const auto n = static_cast<Eigen::Index>(t_.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd b(n);
    b(0) = slope_first;
    b(n - 1) = slope_last;
    for (Eigen::Index i = 1; i + 1 < n; ++i) {  // equal second derivatives on both sides of knot i
      const auto k = static_cast<std::size_t>(i);
      const double h0 = t_[k] - t_[k - 1], h1 = t_[k + 1] - t_[k];
      a(i, i - 1) = 1.0 / h0;
      a(i, i) = 2.0 / h0 + 2.0 / h1;
      a(i, i + 1) = 1.0 / h1;
      b(i) = 3.0 * ((x_[k] - x_[k - 1]) / (h0 * h0) + (x_[k + 1] - x_[k]) / (h1 * h1));
    }
    const Eigen::VectorXd slopes = a.partialPivLu().solve(b);
    v_.assign(slopes.data(), slopes.data() + n);
  }

  double at(double t) const {
    if (t <= t_.front()) return x_.front() + v_.front() * (t - t_.front());
    if (t >= t_.back()) return x_.back();
    const auto k =
        static_cast<std::size_t>(std::upper_bound(t_.begin(), t_.end(), t) - t_.begin() - 1);
    return hermite(t - t_[k], t_[k + 1] - t_[k], x_[k], v_[k], x_[k + 1], v_[k + 1]);
  }

 private:
  std::vector<double> t_, x_, v_;
};

/// Trunk, limbs and furniture of one generated trial as functions of the time t [s], W. Keeps
/// references to its arguments.
class Performer {
 public:
  Performer(const mocap::Body& body, const TrialPlan& plan, const Drawer& drawer);

  const TrialTimes& times() const { return times_; }
  FootState foot(mocap::Side side, double t) const {
    return side == mocap::kLeft ? left_.at(t) : right_.at(t);
  }
  /// Highest pelvis [m] that both legs allow.
  double highest_pelvis(double t) const;
  /// Leans as far as both grasps need. `height_m(t)`: of the pelvis.
  void lean_to_reach(const std::function<double(double)>& height_m);
  /// Track of the pelvis on the ground, z = 0.
  Eigen::Vector3d ground_track(double t) const;
  /// All 17 joints, 51 rows; raises `short_by_m` to the worst miss of a limb's target.
  Eigen::VectorXd posture(double t, double height_m, double* short_by_m) const;
  Eigen::Vector3d handle(double t) const;
  Eigen::Vector3d object(double t) const;

 private:
  double gait(double t) const;    // how much walking is left in the movement: 1 to 0
  double reach(double t) const;   // share of the left hand's reach: 0 to 1
  double grasp(double t) const;   // share of the right hand's reach: 0 to 1
  double pulled(double t) const;  // m
  double lean(double t) const;    // rad
  double drift(double t, int row) const;
  Eigen::Matrix3d root_rotation(double t) const;
  Eigen::VectorXd trunk(double t) const;
  Eigen::Vector3d hand(mocap::Side side, double t, const Eigen::Vector3d& p_W_shoulder) const;
  double stretch(double t, double height_m) const;

  const mocap::Body& body_;
  const TrialPlan& plan_;
  const Drawer& drawer_;
  TrialTimes times_;
  FootPath left_, right_;
  SmoothCurve progress_, phase_;
  double reach_lean_ = 0.0, grasp_lean_ = 0.0;
};

}  // namespace mimesis::synthesizer
