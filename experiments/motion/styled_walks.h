#pragma once
#include <string>
#include <vector>

#include "nodes/synthesizer/dynamics/character_batch.h"
#include "experiments/motion/film.h"
#include "experiments/motion/recorded_walks.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

/// One pattern a style (the mean of its cycles), with tied delays: what characters blend. Rotations
/// are brought to common branches first. Of styles that turn ("walk-turn-left_normal") the cycle
/// that turns most stands for all: the others go straight again.
MotionModel styled_walks(const RecordedWalks& walks, int sources);

/// Number of the pattern of a style. @throws ConfigError if there is none.
int pattern_of(const MotionModel& model, const std::string& style);

/// Character i as the film draws it.
mocap::BodyPose character_pose(const MotionModel& model, const CharacterBatch& batch, int i);

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
