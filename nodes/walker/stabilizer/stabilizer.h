#pragma once
#include <string>

#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/sensors.h"

namespace mimesis::walker {

/// Gains [walking.md 8.6; Kajita 2010; Caron, Kheddar, Tempier 2019].
struct StabilizerSettings {
  double kd = 4.5, ki_1_s = 1.5;  ///< of the divergent component
  // helper: all gains of the recipe with units, ranges and sources
  bool step_adjustment = false;
};

/// The plan at this tick, after the dynamic filter.
struct StabilizerPlan {
  PatternSample pattern;
  ComState com;  ///< with the filter's shift
};

/// What the whole-body motion has to do differently from the plan.
struct StabilizerCommand {
  Eigen::Vector2d com_shift_W_m = Eigen::Vector2d::Zero();
  std::array<Eigen::Isometry3d, 2> X_WS;                        ///< soles to track, corrected
  Eigen::Vector2d landing_shift_W_m = Eigen::Vector2d::Zero();  ///< of the coming step
  // for logs and plots
  Eigen::Vector2d dcm_error_W_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d zmp_W_m = Eigen::Vector2d::Zero(), wished_zmp_W_m = Eigen::Vector2d::Zero();
  Eigen::Vector3d com_W_m = Eigen::Vector3d::Zero();  ///< measured, in the W of the plan
  bool saturated = false;
  bool falling = false;
  std::string reason;  ///< of falling or of sensors that cannot be used
};

class Stabilizer {
 public:
  Stabilizer(const robot::Biped& biped, const GaitSettings& gait,
             const StabilizerSettings& settings);
  void reset();
  /// No allocation. Not finite sensors: the plan without feedback, `reason` says which.
  const StabilizerCommand& step(const StabilizerPlan& plan, const Sensors& sensors);
};

}  // namespace mimesis::walker
