#pragma once
#include <functional>

#include "nodes/synthesizer/drawer/foot_path.h"
#include "nodes/synthesizer/drawer/smooth.h"
#include "nodes/synthesizer/drawer/trial_times.h"

namespace mimesis::synthesizer {

/// Trunk, limbs and furniture of one generated trial as functions of the time t [s], W. Keeps
/// references to what it is made from.
class Performer {
 public:
  Performer(const mocap::Body& body, const TrialPlan& plan, const Drawer& drawer);

  const TrialTimes& times() const { return times_; }
  FootState foot(mocap::Side side, double t) const {
    return side == mocap::kLeft ? left_.at(t) : right_.at(t);
  }
  /// Highest pelvis [m] that both legs allow.
  double highest_pelvis(double t) const;
  /// Leans as far as both grasps need. `height_m(t)`: of the pelvis.
  void lean_to_reach(const std::function<double(double)>& height_m);
  /// Of the pelvis, z = 0.
  Eigen::Vector3d ground_track(double t) const;
  /// All 17 joints, 51 rows; raises `short_by_m` to the worst miss of a limb's target.
  Eigen::VectorXd posture(double t, double height_m, double* short_by_m) const;
  Eigen::Vector3d handle(double t) const;
  Eigen::Vector3d object(double t) const;

 private:
  double gait(double t) const;    // how much walking is left in the movement: 1 to 0
  double reach(double t) const;   // of the left hand: 0 to 1
  double grasp(double t) const;   // of the right hand
  double pulled(double t) const;  // m
  double lean(double t) const;    // rad
  double drift(double t, int row) const;
  Eigen::Matrix3d root_rotation(double t) const;
  Eigen::VectorXd trunk(double t) const;
  Eigen::Vector3d hand(mocap::Side side, double t, const Eigen::Vector3d& p_W_shoulder) const;
  double stretch(double t, double height_m) const;

  const mocap::Body& body_;
  const TrialPlan& plan_;
  const Drawer& drawer_;
  TrialTimes times_;
  FootPath left_, right_;
  SmoothCurve progress_, phase_;
  double reach_lean_ = 0.0, grasp_lean_ = 0.0;
};

}  // namespace mimesis::synthesizer
