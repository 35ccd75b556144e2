#pragma once
#include <span>

#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Upper body at one instant: joints of Biped::upper_body, in that order.
struct UpperBody {
  Eigen::VectorXd q, dq, ddq;  ///< [rad], [rad/s], [rad/s²]
};

struct FilterSettings {
  double window_s = 0.7;   ///< of the correction
  int samples = 20;        ///< in it, evenly
  int iterations = 1;      ///< of correction and inverse dynamics a tick
  bool legs_only = false;  ///< upper body taken as at rest in half-sitting, for comparison
};

/// Correction of the pattern for what the cart-table model leaves out [M18 3.8.2; Yamane and
/// Nakamura 2003; Nishiwaki 2009]: full-body inverse dynamics over a window gives the ZMP that the
/// robot would have; preview control turns its error into a shift of the CoM.
class DynamicFilter {
 public:
  DynamicFilter(const robot::Biped& biped, const GaitSettings& gait,
                const FilterSettings& settings);

  void reset();
  /// Shift of the CoM for this tick. `upper(k)` belongs to k · window/samples ahead; one element:
  /// it stays so. No allocation.
  ComState step(const PatternGenerator& pattern, std::span<const UpperBody> upper);
  /// ZMP of the whole robot at this tick before and after the correction (multi-body − planned).
  Eigen::Vector2d error_before_m() const;
  Eigen::Vector2d error_after_m() const;
};

}  // namespace mimesis::walker
