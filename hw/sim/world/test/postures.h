#pragma once
#include <random>
#include <vector>

#include "common/kin/arm.h"
#include "hw/sim/world/world.h"

namespace mimesis::world {

/// A hand placed for a grip: precision from above at 20 mm below the top, full from the side at mid
/// height.
struct HandPose {
  Grip grip = Grip::precision;
  double azimuth = 0.0;  ///< direction of the full grip's approach about z of W [rad]
  bool flipped = false;  ///< y_E down instead of up

  /// Where E shall be for an object at `object`, `back` along the approach and `up` in W [m].
  kin::IkGoal goal(const Eigen::Vector3d& object, double height, double back, double up) const {
    const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
    if (grip == Grip::precision) {
      return {.position_in_W = object + (height / 2 - 0.02 + back + up) * z, .axes = {{z, -z}}};
    }
    const Eigen::Vector3d approach(std::cos(azimuth), std::sin(azimuth), 0.0);
    return {.position_in_W = object - back * approach + up * z,
            .axes = {{z, approach}, {Eigen::Vector3d::UnitY(), flipped ? -z : z}}};
  }
};

/// Two postures, one short motion apart.
struct Reach {
  HandPose pose;
  Eigen::VectorXd before, at;
};

/// Postures found from random starts; deterministic.
class PostureSearch {
 public:
  PostureSearch(kin::ArmModel arm, kin::Table table)
      : arm_(std::move(arm)), table_(std::move(table)) {}

  /// To grasp the object where it stands: `before` is 10 cm back along the approach.
  std::vector<Reach> grasps(Grip grip, int attempts) {
    return search(grip, attempts, table_.object, 0.10, 0.0, 0.0, false);
  }
  /// To put the object down at `goal`: `before` is 8 cm above, `at` 3 mm.
  std::vector<Reach> places(Grip grip, int attempts, const Eigen::Vector3d& goal) {
    return search(grip, attempts, goal, 0.0, 0.08, 0.003, true);
  }

  /// No ball touches anything; the object stands at its place, or is held as `pose` grasps it.
  bool is_free(const Eigen::VectorXd& q, const HandPose& pose, bool held, bool touching) const {
    std::vector<Eigen::Isometry3d> X;
    kin::forward(arm_, q, X);
    ObjectInScene object{
        .cylinder = {.radius = table_.object_radius, .height = table_.object_height}};
    object.cylinder.X_WO.translation() = table_.object;
    object.between_fingers = touching;
    if (held) {
      object.held = true;
      const Eigen::Isometry3d X_WE = X.back() * arm_.X_LE;
      const Eigen::Vector3d from_center =
          pose.goal({0, 0, 0}, table_.object_height, 0, 0).position_in_W;
      object.cylinder.X_WO.translation() = X_WE.translation() - from_center;
    }
    CollisionMonitor monitor(arm_, table_);
    monitor.update(X, object);
    return monitor.count() == 0;
  }

 private:
  std::vector<Reach> search(Grip grip, int attempts, const Eigen::Vector3d& object, double back,
                            double up, double lowest, bool held) {
    std::vector<Reach> found;
    std::uniform_real_distribution<double> any(0.0, 1.0);
    for (int i = 0; i < attempts; ++i) {
      const HandPose pose{grip, 2 * M_PI * any(generator_), any(generator_) < 0.5};
      Eigen::VectorXd start(arm_.dof());
      for (int j = 0; j < arm_.dof(); ++j) {
        start[j] = arm_.q_min[j] + (arm_.q_max[j] - arm_.q_min[j]) * any(generator_);
      }
      const double height = table_.object_height;
      const auto at = kin::solve_ik(arm_, pose.goal(object, height, 0.0, lowest), start);
      if (!at || !is_free(*at, pose, held, true)) continue;
      const auto before = kin::solve_ik(arm_, pose.goal(object, height, back, up), *at);
      if (!before || (*before - *at).norm() > 1.5) continue;
      const Eigen::VectorXd middle = (*before + *at) / 2;
      if (is_free(*before, pose, held, false) && is_free(middle, pose, held, true)) {
        found.push_back({pose, *before, *at});
      }
    }
    return found;
  }

  kin::ArmModel arm_;
  kin::Table table_;
  std::mt19937 generator_{1};
};

}  // namespace mimesis::world
