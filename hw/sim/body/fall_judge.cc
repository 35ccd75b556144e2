#include "hw/sim/body/fall_judge.h"

#include <algorithm>
#include <cmath>

namespace mimesis::hw::sim {
namespace {

// The CoM below this share of the standing height, or this tilt of the trunk from the set-points'
// tilt on level soles: a robot that bends for a low drawer has not fallen.
constexpr double kFallenShare = 0.6, kFallenTilt_rad = 0.9;

}  // namespace

FallJudge::FallJudge(const robot::Biped& biped, const Eigen::Vector3d& up_W)
    : biped_(&biped), up_W_(up_W), wished_(biped.tree) {}

std::string FallJudge::how(const Eigen::Vector3d& com_W_m, const Eigen::Matrix3d& R_WT,
                           const Eigen::VectorXd& set_point, robot::Side loaded) {
  const double height = up_W_.dot(com_W_m);
  if (height < kFallenShare * biped_->com_height_m) {
    return "centre of mass at " + std::to_string(height) + " m";
  }
  // the trunk's z axis from where the set-points have it above a level sole
  wished_.update(Eigen::Isometry3d::Identity(), set_point);
  const Eigen::Vector3d z_B = wished_.X_WL(biped_->leg[loaded].sole).linear().col(2);
  const Eigen::Vector3d up_T = wished_.X_WL(biped_->trunk).linear().transpose() * z_B;
  const double tilt = std::acos(std::clamp(up_T.dot(R_WT.row(2).transpose()), -1.0, 1.0));
  if (tilt > kFallenTilt_rad) return "trunk tilted by " + std::to_string(tilt) + " rad";
  return {};
}

}  // namespace mimesis::hw::sim
