#pragma once
#include "hw/sim/world/shapes.h"

namespace mimesis::world {

/// The hand's mode.
enum class Grip { none, precision, full };

/// The open hand around frame E (z approach, x across the fingers), as the arm's safety balls draw
/// it.
struct HandShape {
  double aperture = 0.058;  ///< between the inner faces of the open fingers [m]
  double tips = 0.026;      ///< fingers end this far beyond E [m]
  double palm = 0.038;      ///< the palm ends this far before E [m]
  double pad = 0.016;       ///< half the width of a finger [m]
  double overlap = 0.005;   ///< fingers must reach this far past what they hold [m]
  double max_tilt = 0.2;    ///< between the hand and the ideal grasp [rad]
};

/// Where the fingers would meet the object.
struct GraspContact {
  bool reachable = false;  ///< the object is between the fingers, in the manner of the grip
  double closure = 0.0;    ///< at which they hold it: 0 open .. 1 closed [1]
};

/// Geometry of a grasp of an upright cylinder. With p = the held point in E:
/// precision: fingers from above, z_E = −z_O, p = middle of the top: |p_x| ≤ ½aperture − r, |p_y| ≤
/// pad,
///   −palm ≤ p_z ≤ tips − overlap;
/// full: from the side, y_E = ±z_O, p = centre: |p_x| ≤ ½aperture − r, |p_y| ≤ ½h − pad,
///   −palm + r ≤ p_z ≤ tips − overlap.
/// Both fingers close evenly, aperture·(1 − closure), and push the object to the middle: they hold
/// it at closure = 1 − 2r / aperture. An object that lies cannot be grasped.
GraspContact grasp_contact(const HandShape& hand, Grip grip, const Eigen::Isometry3d& X_WE,
                           const Cylinder& object);

}  // namespace mimesis::world
