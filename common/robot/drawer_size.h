#pragma once
#include "common/robot/biped.h"

namespace mimesis::robot {

/// A piece of furniture with a drawer that a robot reaches in the postures in which biped.urdf, in
/// the proportions of HRP-2, reaches the one of [M18 3.8.4] (the defaults): heights are below the
/// shoulders, and depths before them, by as many lengths of the arm, rounded to a millimetre.
struct DrawerSize {
  double handle_height_m = 0.92, handle_left_m = 0.14;  ///< + to the left
  double object_height_m = 0.90;
  double pull_m = 0.20;                                ///< how far the left hand opens it
  double least_depth_m = 0.124, most_depth_m = 0.273;  ///< depth of objects behind its front
  /// From pelvis to object, along the ground, when the robot stands before it and it is closed:
  /// comfortable for the least and for the most depth.
  double least_reach_m = 0.663, most_reach_m = 0.755;

  /// Comfortable reach to an object so deep: it grows less than the depth [M18 fig. 3.7].
  double reach_m(double depth_m) const {
    const double rise = (most_reach_m - least_reach_m) / (most_depth_m - least_depth_m);
    return least_reach_m + rise * (depth_m - least_depth_m);
  }
};

/// @throws ConfigError as arm_of(), or if the arms reach no height above the ground
DrawerSize drawer_size(const Biped& biped);

}  // namespace mimesis::robot
