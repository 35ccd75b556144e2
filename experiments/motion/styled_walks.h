#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/motion/mocap/body.h"
#include "common/motion/mocap/trials.h"
#include "common/motion/model/motion_model.h"
#include "experiments/harness/figure.h"
#include "nodes/synthesizer/dynamics/character_batch.h"
#include "nodes/synthesizer/dynamics/posture.h"

namespace mimesis::synthesizer {

/// Clips of the shared folder ($MIMESIS_SHARED/data/mocap, or ../shared of where one is), which are
/// no part of the repository.

struct RecordedWalks {
  mocap::Body body;      ///< body of the first clip
  mocap::Trials trials;  ///< gait cycles of all clips, in their order
};

/// Names are relative to data/mocap: "cmu_bvh/07_01.bvh". Empty: all are there; else the first that
/// is not, with its folder.
std::string absent_clip(const std::vector<std::string>& clips);
/// Gait cycles, cut with their heading taken out. @throws ConfigError, and std::runtime_error for a
/// clip without a cycle
RecordedWalks recorded_walks(const std::vector<std::string>& clips);
/// Report of a figure that cannot be made without this clip: one row that fails.
reproduce::Report report_absent(const std::string& clip);

/// One figure whose angles come from anywhere, on the ground: the pelvis moves and turns so that
/// the lower foot rests [M18 3.5]. It changes when the other is lower by 5 mm.
class GroundedFigure {
 public:
  /// At the origin, heading along x. @throws ConfigError if a row of the model is no body row.
  explicit GroundedFigure(const motion::MotionModel& model);

  /// Takes the angles [rad] of the model's rows, dt after those before.
  void step(const Eigen::VectorXd& angles_rad, double dt_s);

  const Eigen::Vector2d& position_W_m() const { return position_; }
  double heading_rad() const { return heading_; }  ///< + to the left, not wrapped
 private:
  mocap::Body body_;
  std::vector<int> body_row_;
  Eigen::Matrix<double, mocap::kBodyRows, 1> angles_;
  int support_ = mocap::kLeft;
  std::optional<Eigen::Matrix<double, 2, 4>> feet_;  ///< heels, toes from above, by side
  Eigen::Vector2d position_ = Eigen::Vector2d::Zero();
  double heading_ = 0.0;
};

/// The cycles that styles are learned from, rotations brought to common branches. For styles that
/// turn ("walk-turn-left_normal") the cycle that turns most is used: the others go straight again.
mocap::Trials styled_cycles(const RecordedWalks& walks);
/// One pattern a style (the mean of its cycles), with tied delays: the input of blends.
motion::MotionModel styled_walks(const RecordedWalks& walks, int sources);

/// Number of the pattern of a style. @throws ConfigError if there is none.
int pattern_of(const motion::MotionModel& model, const std::string& style);

/// Mean speed of standing feet: of the lower of heel and toe, from 4 % to 55 % of the cycle after
/// the foot's strike (left: phase 0, right: half a cycle), while it is the same point as a step
/// before.
class FootSlide {
 public:
  explicit FootSlide(double dt_s) : dt_s_(dt_s) {}
  void observe(const CharacterBatch& batch, int i);
  double mean_m_s() const { return count_ > 0 ? path_ / (count_ * dt_s_) : 0.0; }

 private:
  struct Point {
    bool toe = false, stands = false;
    Eigen::Vector2d p_W = Eigen::Vector2d::Zero();
  };
  double dt_s_, path_ = 0.0;
  int count_ = 0;
  Point before_[2];
};

}  // namespace mimesis::synthesizer
