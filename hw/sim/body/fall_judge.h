#pragma once
#include <string>

#include "common/robot/biped.h"
#include "common/robot/kinematics.h"

namespace mimesis::hw::sim {

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
