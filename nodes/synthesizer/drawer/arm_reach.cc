#include "nodes/synthesizer/drawer/arm_reach.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "nodes/synthesizer/drawer/limb_ik.h"

namespace mimesis::synthesizer {
namespace {
constexpr double kRest = 0.004;  // where x starts and what it leaves: 0 and 1 are never reached
}

void ArmReach::start(bool to_target, double duration_s) {
  x_ = std::clamp(x_, kRest, 1.0 - kRest);
  const double way = 2.0 * std::log((1.0 - kRest) / kRest);  // u·t from one rest to the other
  u_1_s_ = (to_target ? way : -way) / duration_s;
}

void ArmReach::step(double dt_s) {
  if (u_1_s_ == 0.0) return;
  const double odds = x_ / (1.0 - x_) * std::exp(u_1_s_ * dt_s);
  x_ = std::clamp(odds / (1.0 + odds), kRest, 1.0 - kRest);
}

double ArmReach::share() const { return std::clamp((x_ - kRest) / (1.0 - 2.0 * kRest), 0.0, 1.0); }

double ArmReach::apply(const mocap::Body& body, mocap::Side side, const Eigen::Vector3d& p_W_pelvis,
                       const Eigen::Vector3d& p_W_target,
                       Eigen::Ref<Eigen::VectorXd> angles_rad) const {
  const double x = share();
  if (x == 0.0) return 0.0;
  const int shoulder = side == mocap::kLeft ? mocap::kLeftShoulder : mocap::kRightShoulder;
  const auto s = static_cast<std::size_t>(shoulder);
  const auto pose = forward_kinematics(
      body, std::span<const double, mocap::kBodyRows>(angles_rad.data(), mocap::kBodyRows),
      p_W_pelvis);
  const Eigen::Vector3d gait = pose.point(shoulder + 2, body.hand_m[side]);
  const Eigen::Vector3d hand = gait + x * (p_W_target - gait);
  const Eigen::Vector3d elbow = pose.p_WJ[s + 1] - 0.5 * (pose.p_WJ[s] + gait);
  const LimbAngles arm =
      arm_angles(body, side, pose.R_WJ[mocap::kChest], pose.p_WJ[s], hand, elbow);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d before = angles_rad.segment<3>(3 * (shoulder + i));
    angles_rad.segment<3>(3 * (shoulder + i)) =
        math::nearest_axis_angle(arm.axis_angle_rad[static_cast<std::size_t>(i)], before);
  }
  return arm.short_by_m;
}

}  // namespace mimesis::synthesizer
