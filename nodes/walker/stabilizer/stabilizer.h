#pragma once
#include <string>

#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/attitude.h"
#include "nodes/walker/stabilizer/balance.h"
#include "nodes/walker/stabilizer/estimator.h"
#include "nodes/walker/stabilizer/feet.h"
#include "nodes/walker/stabilizer/slope.h"

namespace mimesis::walker {

/// Plan for this tick, after the dynamic filter.
struct StabilizerPlan {
  PatternSample pattern;
  ComState com;  ///< with the filter's shift
  /// Pelvis pose of the set-points that were sent last, for a rigid robot on its soles.
  Eigen::Isometry3d X_WB_last = Eigen::Isometry3d::Identity();
};

/// Changes of the plan for the whole-body motion.
struct StabilizerCommand {
  Eigen::Vector2d com_shift_W_m = Eigen::Vector2d::Zero(), com_shift_v_W = Eigen::Vector2d::Zero();
  std::array<Eigen::Isometry3d, 2> X_WS;  ///< soles to track, corrected
  /// Movement of the whole pattern before the next tick, because a step was adjusted.
  Eigen::Vector2d pattern_shift_W_m = Eigen::Vector2d::Zero();
  GroundPlane ground;  ///< where the next plan's level ground is
  // for logs and plots
  Eigen::Vector2d dcm_error_W_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d zmp_W_m = Eigen::Vector2d::Zero(), wished_zmp_W_m = Eigen::Vector2d::Zero();
  Eigen::Vector3d com_W_m = Eigen::Vector3d::Zero();       ///< measured, in W, less its offset
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();  ///< pelvis likewise
  bool saturated = false;
  bool falling = false;
  std::string reason;  ///< why it is falling or why sensors cannot be used
};

/// Keeps a walking biped upright by measurements [Kajita 2010; Caron, Kheddar, Tempier 2019;
/// docs/walking.md 6]: estimator, feedback of the divergent component, distribution to the feet,
/// then admittances of ankles, feet and CoM that turn forces into positions for stiff joints.
class Stabilizer {
 public:
  Stabilizer(const robot::Biped& biped, const GaitSettings& gait,
             const StabilizerSettings& settings);
  Stabilizer(const Stabilizer&) = delete;
  Stabilizer& operator=(const Stabilizer&) = delete;
  /// The attitude is kept: it does not depend on the plan.
  void reset();
  /// Attitude of the IMU before balance begins, once a tick. @return as the last step() with usable
  /// sensors
  const Eigen::Quaterniond& watch(const Sensors& sensors);
  /// Does not allocate. With unusable sensors: the plan without feedback; `reason` says which one.
  const StabilizerCommand& step(const StabilizerPlan& plan, const Sensors& sensors);

 private:
  static constexpr int kHistory = 16;
  struct Past {
    StabilizerPlan plan;
    std::array<Eigen::Isometry3d, 2> X_WS_last;  ///< soles of the set-points that were sent last
  };
  const Eigen::Quaterniond& attitude(const Sensors& sensors,
                                     const std::optional<AttitudeFilter::Seen>& seen, bool rests);
  void measure_ground(const PatternSample& plan, const BodyEstimate& body);
  void measure_give(const Past& sent);
  const StabilizerPlan& remember(const StabilizerPlan& plan);
  const StabilizerPlan& adjusted(const StabilizerPlan& plan);
  void move_com();
  void without_feedback(const StabilizerPlan& plan, const char* why);
  void watch_fall(const BodyEstimate& body, const Eigen::Isometry3d& X_WB_sent);
  void filter(const std::array<robot::Wrench, 2>& foot_S);

  StabilizerSettings settings_;
  double weight_n_, wrench_share_;
  AttitudeFilter attitude_;
  Estimator estimator_;
  SlopeEstimate slope_;
  DcmFeedback feedback_;
  ComOffset offset_;
  ComAdmittance admittance_;
  StepAdjustment adjustment_;
  LegGive give_;
  Ground ground_;
  Feet feet_;
  std::array<Past, kHistory> history_;  ///< ring: the last plans
  int at_ = 0, remembered_ = 0;
  bool blind_ = true;  ///< no measurement in the last tick
  int unseen_ = 0;     ///< ticks without an IMU
  std::array<robot::Wrench, 2> wrench_S_;
  StabilizerPlan plan_;  ///< plan of this tick, with adjusted feet
  StabilizerCommand command_;
};

}  // namespace mimesis::walker
