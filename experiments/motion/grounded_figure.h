#pragma once
#include <Eigen/Core>

#include "nodes/synthesizer/dynamics/posture.h"
#include "nodes/synthesizer/dynamics/root_motion.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

/// One figure whose angles come from anywhere, on the ground: root motion from its standing foot
/// (root_motion.h) without foot lock.
class GroundedFigure {
 public:
  /// At the origin, heading along x. @throws ConfigError if a row of the model is no body row.
  explicit GroundedFigure(const MotionModel& model);

  /// Takes the angles [rad] of the model's rows, dt after those before.
  void step(const Eigen::VectorXd& angles_rad, double dt_s);

  const Eigen::Vector2d& position_W_m() const { return position_; }
  double heading_rad() const { return heading_; }  ///< + to the left, not wrapped
  /// Moves the figure: for films.
  void place(const Eigen::Vector2d& position_W_m) { position_ = position_W_m; }
  mocap::BodyPose pose() const;

 private:
  mocap::Body body_;
  BodyLanes lanes_;
  std::vector<int> body_row_;
  Eigen::Matrix<double, mocap::kBodyRows, 1> angles_;
  RootLanes root_;
  Eigen::Vector2d position_ = Eigen::Vector2d::Zero();
  double heading_ = 0.0;
};

/// The figure with these angles, the root's relative to the heading; pelvis at p_W.
mocap::BodyPose figure_pose(const mocap::Body& body,
                            const Eigen::Matrix<double, mocap::kBodyRows, 1>& angles_rad,
                            const Eigen::Vector3d& p_W, double heading_rad);
/// By row of the model the body's row. @throws ConfigError if one is none.
std::vector<int> body_rows(const MotionModel& model);

}  // namespace mimesis::synthesizer
