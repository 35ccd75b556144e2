#include "common/robot/drawer_size.h"

#include <cmath>

#include "common/error.h"
#include "common/robot/kinematics.h"

namespace mimesis::robot {
namespace {

/// Shoulder of the half-sitting robot relative to its pelvis (z: above the ground), and arm length.
struct Reach {
  Eigen::Vector3d shoulder_m;  ///< left
  double arm_m = 0.0;          ///< to the point between the fingers
};

// biped.urdf's
const Reach kStandard{.shoulder_m = {0.03, 0.25, 1.178702}, .arm_m = 0.63};

Reach reach_of(const Biped& biped) {
  const Arm arm = arm_of(biped, kLeft);
  const Kinematics zero(biped.tree);
  const auto p = [&](int link) { return Eigen::Vector3d(zero.X_WL(link).translation()); };
  Reach reach{.shoulder_m = p(arm.shoulder),
              .arm_m = (p(arm.elbow) - p(arm.shoulder)).norm() +
                       (p(arm.wrist) - p(arm.elbow)).norm() +
                       (p(biped.hand[kLeft]) - p(arm.wrist)).norm()};
  reach.shoulder_m.z() += biped.X_WB_half_sitting.translation().z();
  return reach;
}

double to_mm(double x_m) { return std::round(1e3 * x_m) / 1e3; }

}  // namespace

DrawerSize drawer_size(const Biped& biped) {
  const Reach reach = reach_of(biped);
  const double arms = reach.arm_m / kStandard.arm_m;
  const DrawerSize standard;
  const auto height = [&](double z_m) {
    return to_mm(reach.shoulder_m.z() - arms * (kStandard.shoulder_m.z() - z_m));
  };
  const auto ahead = [&](double x_m) {
    return to_mm(reach.shoulder_m.x() + arms * (x_m - kStandard.shoulder_m.x()));
  };
  DrawerSize size{
      .handle_height_m = height(standard.handle_height_m),
      .handle_left_m =
          to_mm(standard.handle_left_m * reach.shoulder_m.y() / kStandard.shoulder_m.y()),
      .object_height_m = height(standard.object_height_m),
      .pull_m = to_mm(arms * standard.pull_m),
      .least_depth_m = to_mm(arms * standard.least_depth_m),
      .most_depth_m = to_mm(arms * standard.most_depth_m),
      .least_reach_m = ahead(standard.least_reach_m),
      .most_reach_m = ahead(standard.most_reach_m),
  };
  if (!(size.object_height_m > 0.0 && size.least_depth_m > 0.0)) {
    throw ConfigError(biped.tree.name() + ": arms of " + std::to_string(reach.arm_m) +
                      " m on shoulders " + std::to_string(reach.shoulder_m.z()) +
                      " m high, expected some that reach a drawer above the ground");
  }
  return size;
}

}  // namespace mimesis::robot
