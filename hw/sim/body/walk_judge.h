#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/robot/biped.h"
#include "common/robot/kinematics.h"
#include "hw/sim/body/body_world.h"

namespace mimesis::hw::sim {

/// Quality of a walk so far: the figures of v1.WalkOutcome.
struct WalkFigures {
  bool fell = false;
  std::string how;  ///< it fell
  int steps = 0;    ///< set down by the plan
  /// Foot placement error relative to the other foot, the part that the walker controls.
  double step_error_max_m = 0.0, step_error_rms_m = 0.0;
  /// Along the other foot, against the wished length; 0 if none was wished.
  double step_length_error_max_m = 0.0;
  double ankle_pitch_peak_n_m = 0.0;       ///< peak of the means over the ticks
  double ankle_pitch_slow_peak_n_m = 0.0;  ///< low-passed
  double normal_peak_n = 0.0;              ///< both feet, low-passed
  double raw_normal_peak_n = 0.0;          ///< both feet, of single steps of the physics
  /// Error of the ZMP of the contact forces against the plan, relative to the feet: drift does not
  /// count.
  Eigen::Vector2d zmp_error_rms_m = Eigen::Vector2d::Zero();
};

/// ZMP and feet of the plan at one tick: left, right.
struct PlannedGround {
  Eigen::Vector2d zmp_W_m = Eigen::Vector2d::Zero();
  std::array<Eigen::Vector2d, 2> foot_W_m{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  std::array<double, 2> foot_yaw_rad{};
};

/// From where things are to where they would be if the feet stood as planned, by the share of the
/// weight on each: drift of the whole robot over the ground is no error of balance.
Eigen::Isometry2d truth_to_plan(const PlannedGround& plan, const BodyTruth& truth);

/// A foot that the plan sets down.
struct JudgedStep {
  robot::Side side = robot::kLeft;
  Eigen::Vector2d planned_W_m = Eigen::Vector2d::Zero();        ///< origin of its sole
  Eigen::Vector2d planned_other_W_m = Eigen::Vector2d::Zero();  ///< origin of the other foot's sole
  double planned_other_yaw_rad = 0.0;
  std::optional<double> wished_length_m = {};  ///< forward from the other foot, along its heading
};

/// Watches a walk in simulation. Call in the order of time.
class WalkJudge {
 public:
  /// After every tick. `plan`: empty while there is none.
  void tick(const BodyTruth& truth, const std::optional<PlannedGround>& plan);
  /// The plan puts this foot on the ground at the tick that was last reported.
  void step(const JudgedStep& step);

  const WalkFigures& figures() const { return figures_; }

 private:
  struct Landed {
    JudgedStep step;
    double read_at_s;
  };
  void read(const JudgedStep& step, const BodyTruth& truth);

  WalkFigures figures_;
  std::vector<Landed> landed_;  ///< not read yet
  bool started_ = false;
  double time_s_ = 0.0;
  double normal_n_ = 0.0;                    ///< low-passed
  std::array<double, 2> ankle_pitch_n_m_{};  ///< low-passed
  Eigen::Vector2d zmp_squares_ = Eigen::Vector2d::Zero();
  long zmp_count_ = 0;
  double step_squares_ = 0.0;
  int steps_read_ = 0;
};

/// Tells when a biped has fallen, in any physics [docs/walking.md 7.1].
class FallJudge {
 public:
  /// `up_W`: normal of the ground. The biped outlives this.
  FallJudge(const robot::Biped& biped, const Eigen::Vector3d& up_W);

  /// How it has fallen, in words; empty: it has not. `R_WT`: the trunk's; `set_point`: dof [rad];
  /// `loaded`: the foot with more weight on it.
  std::string how(const Eigen::Vector3d& com_W_m, const Eigen::Matrix3d& R_WT,
                  const Eigen::VectorXd& set_point, robot::Side loaded);

 private:
  const robot::Biped* biped_;
  Eigen::Vector3d up_W_;
  robot::Kinematics wished_;  ///< kinematics of the set-points
};

}  // namespace mimesis::hw::sim
