#pragma once
#include <string>

#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/adjustment.h"
#include "nodes/walker/stabilizer/balance.h"
#include "nodes/walker/stabilizer/feet.h"
#include "nodes/walker/stabilizer/leg_give.h"
#include "nodes/walker/stabilizer/sensors.h"

namespace mimesis::walker {

/// The plan at this tick, after the dynamic filter.
struct StabilizerPlan {
  PatternSample pattern;
  ComState com;  ///< with the filter's shift
  /// Pelvis of the set-points that were sent last: what a rigid robot on its soles would do.
  Eigen::Isometry3d X_WB_last = Eigen::Isometry3d::Identity();
};

/// What the whole-body motion has to do differently from the plan.
struct StabilizerCommand {
  Eigen::Vector2d com_shift_W_m = Eigen::Vector2d::Zero(), com_shift_v_W = Eigen::Vector2d::Zero();
  std::array<Eigen::Isometry3d, 2> X_WS;  ///< soles to track, corrected
  /// By how much the whole pattern has to move before the next tick: a step was adjusted.
  Eigen::Vector2d pattern_shift_W_m = Eigen::Vector2d::Zero();
  // for logs and plots
  Eigen::Vector2d dcm_error_W_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d zmp_W_m = Eigen::Vector2d::Zero(), wished_zmp_W_m = Eigen::Vector2d::Zero();
  Eigen::Vector3d com_W_m = Eigen::Vector3d::Zero();  ///< measured, in the W of the plan
  bool saturated = false;
  bool falling = false;
  std::string reason;  ///< of falling or of sensors that cannot be used
};

/// Keeps a walking biped upright by what it measures [Kajita 2010; Caron, Kheddar, Tempier 2019;
/// walking.md 8.6]: estimate, feedback of the divergent component, wrenches of the feet, then
/// admittances of ankles, feet and CoM that turn forces into positions for stiff joints.
class Stabilizer {
 public:
  Stabilizer(const robot::Biped& biped, const GaitSettings& gait,
             const StabilizerSettings& settings);
  Stabilizer(const Stabilizer&) = delete;
  Stabilizer& operator=(const Stabilizer&) = delete;
  void reset();
  /// No allocation. Not finite sensors: the plan without feedback, `reason` says which.
  const StabilizerCommand& step(const StabilizerPlan& plan, const Sensors& sensors);

 private:
  static constexpr int kHistory = 16;
  struct Past {
    StabilizerPlan plan;
    std::array<Eigen::Isometry3d, 2> X_WS_last;  ///< soles of the set-points that were sent last
  };
  void measure_give(const Past& sent);
  const StabilizerPlan& remember(const StabilizerPlan& plan);
  const StabilizerPlan& adjusted(const StabilizerPlan& plan);
  void move_com();
  void without_feedback(const StabilizerPlan& plan, const char* why);
  void watch_fall(const BodyEstimate& body, const Eigen::Isometry3d& X_WB_sent);
  void filter(const std::array<robot::Wrench, 2>& foot_S);

  StabilizerSettings settings_;
  double weight_n_, wrench_share_;
  Estimator estimator_;
  DcmFeedback feedback_;
  ComAdmittance admittance_;
  StepAdjustment adjustment_;
  LegGive give_;
  Ground ground_;
  Feet feet_;
  std::array<Past, kHistory> history_;  ///< ring: the last plans
  int at_ = 0, remembered_ = 0;
  bool blind_ = true;  ///< no measurement in the last tick
  std::array<robot::Wrench, 2> wrench_S_;
  StabilizerPlan plan_;  ///< of this tick, with the feet where they are led
  StabilizerCommand command_;
};

}  // namespace mimesis::walker
