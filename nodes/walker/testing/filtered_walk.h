#pragma once
#include "nodes/walker/filter/dynamic_filter.h"

namespace mimesis::walker {

/// A straight walk with moving arms, planned, filtered, and looked at with the full dynamics.
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
