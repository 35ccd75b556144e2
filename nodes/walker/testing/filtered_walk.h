#pragma once
#include <cmath>
#include <numbers>

#include "common/math/minimum_jerk.h"
#include "nodes/walker/filter/dynamic_filter.h"
#include "nodes/walker/filter/whole_body.h"

namespace mimesis::walker {

/// Upper body of biped.urdf that moves as in walking and reaching at once: arms swing in step with
/// the legs, both reach forward, the trunk turns and bends with them, all with the period of two
/// steps. Begins softly, 1 s to 3 s after the start.
class SwingingArms {
 public:
  /// `size`: 1 for a swing of ±0.5 rad and a reach of 0.9 rad, 0 for half-sitting.
  SwingingArms(const robot::Biped& biped, double size) : biped_(&biped), size_(size) {}

  void at(double time_s, UpperBody& out) const {
    const auto n = static_cast<Eigen::Index>(biped_->upper_body.size());
    out.q = biped_->half_sitting(biped_->upper_body);
    out.dq = Eigen::VectorXd::Zero(n);
    out.ddq = Eigen::VectorXd::Zero(n);
    if (size_ == 0.0 || time_s <= kBegin_s) return;
    add("left_shoulder_pitch", 0.5, -0.45, time_s, out);
    add("right_shoulder_pitch", -0.5, -0.45, time_s, out);
    add("waist_yaw", 0.15, 0.0, time_s, out);
    add("waist_pitch", 0.0, 0.08, time_s, out);
  }

 private:
  static constexpr double kBegin_s = 1.0, kRamp_s = 2.0, kPeriod_s = 1.6;

  /// Adds e(t) (swing · sin ωt + reach · (1 − cos ωt)) to a joint, e: the soft beginning.
  void add(const char* joint, double swing, double reach, double time_s, UpperBody& out) const {
    const int dof = biped_->tree.require_joint(joint);
    const auto i = std::ranges::find(biped_->upper_body, dof) - biped_->upper_body.begin();
    const double w = 2.0 * std::numbers::pi / kPeriod_s, s = std::sin(w * time_s),
                 c = std::cos(w * time_s);
    const double f = swing * s + reach * (1.0 - c), df = w * (swing * c + reach * s),
                 ddf = w * w * (reach * c - swing * s);
    const double u = std::min(1.0, (time_s - kBegin_s) / kRamp_s);
    const double e = size_ * math::minimum_jerk(u);
    const double de = size_ * math::minimum_jerk_rate(u) / kRamp_s;
    const double dde = size_ * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (kRamp_s * kRamp_s);
    out.q[i] += e * f;
    out.dq[i] += e * df + de * f;
    out.ddq[i] += e * ddf + 2.0 * de * df + dde * f;
  }

  const robot::Biped* biped_;
  double size_;
};

/// A straight walk with moving arms, planned, filtered, and evaluated with the full dynamics.
struct FilteredWalk {
  struct Tick {
    double time_s = 0.0;
    /// ZMP: of the cart-table model, and the error that the whole robot makes against it without
    /// and with the filter [m].
    Eigen::Vector2d planned_m, error_before_m, error_after_m;
  };
  std::vector<Tick> ticks;
  int unreachable = 0;  ///< samples in which a leg was too short
  /// Root of the mean square of errors in steady walking [m].
  Eigen::Vector2d rms_before_m() const, rms_after_m() const;
};

/// @param arms  size of the upper body's motion (SwingingArms)
FilteredWalk filtered_walk(const robot::Biped& biped, double speed_m_s, double arms,
                           const FilterSettings& settings, double duration_s = 10.0);

}  // namespace mimesis::walker
