#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "common/math/so3.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/estimator.h"
#include "nodes/walker/stabilizer/settings.h"

namespace mimesis::walker {

/// The ground as a plane of W, z = h + s·(p − p₀) [docs/walking.md 6.9]. Patterns are planned on
/// level ground and hold on any plane: with the CoM at a constant height above it the linear
/// inverted pendulum is the same along x and y [Kajita 2001].
struct GroundPlane {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();  ///< s, rise along x and y of W [1]
  Eigen::Vector2d at_W_m = Eigen::Vector2d::Zero();
  double height_m = 0.0;  ///< h

  double height(const Eigen::Vector2d& p_W_m) const { return height_m + slope.dot(p_W_m - at_W_m); }
  /// Puts a foot of a level plan on the plane.
  void carry(FootState& foot) const {
    foot.X_WS.translation().z() += height(foot.X_WS.translation().head<2>());
    foot.X_WS.linear() =
        math::rotation_onto(Eigen::Vector3d::UnitZ(), {-slope.x(), -slope.y(), 1.0}) *
        foot.X_WS.linear();
    foot.v_W.z() += slope.dot(foot.v_W.head<2>());
    foot.a_W.z() += slope.dot(foot.a_W.head<2>());
  }
  /// Turns about the ground at `p_W_m`, which stays.
  void turn(const Eigen::Vector2d& p_W_m, const Eigen::Vector2d& new_slope) {
    height_m = height(p_W_m);
    at_W_m = p_W_m;
    slope = new_slope;
  }
};

/// Inclination of the ground by the soles that stand on it: attitude and encoders give theirs. The
/// plane turns about where the robot stands.
class SlopeEstimate {
 public:
  explicit SlopeEstimate(const StabilizerSettings& settings) : settings_(&settings) {}

  void reset() {
    ground_ = {};
    age_s_ = 0.0;
  }
  const GroundPlane& ground() const { return ground_; }
  /// @param up_W  normals of both soles. `load_n`: normal forces. `least_n`: a foot with less may
  /// stand on an edge
  const GroundPlane& step(const PatternSample& plan, const std::array<Eigen::Vector3d, 2>& up_W,
                          const std::array<double, 2>& load_n, double least_n) {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double load = 0.0;
    for (Side s : robot::kSides) {
      if (!plan.contact[s] || load_n[s] < least_n) continue;
      sum -= load_n[s] / up_W[s].z() * up_W[s].head<2>();
      load += load_n[s];
    }
    if (load <= 0.0 || !settings_->slope) return ground_;
    age_s_ = std::min(age_s_ + kTick_s, settings_->slope_filter_s);  // a mean, at first
    Eigen::Vector2d change = kTick_s / age_s_ * (sum / load - ground_.slope);
    const double most = kMost_1_s * kTick_s;
    if (change.norm() > most) change *= most / change.norm();
    Eigen::Vector2d slope = ground_.slope + change;
    if (slope.norm() > kMost) slope *= kMost / slope.norm();
    const double left = left_weight(plan);
    ground_.turn(left * plan.foot[kLeft].X_WS.translation().head<2>() +
                     (1.0 - left) * plan.foot[kRight].X_WS.translation().head<2>(),
                 slope);
    return ground_;
  }

 private:
  /// Steepest ground, and the speed at which soles turn to it: no ankle has to be quick.
  static constexpr double kMost = 0.15, kMost_1_s = 0.1;

  const StabilizerSettings* settings_;
  double age_s_ = 0.0;
  GroundPlane ground_;
};

}  // namespace mimesis::walker
