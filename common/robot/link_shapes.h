#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "common/robot/biped.h"

namespace mimesis::robot {

enum class BodyPart { trunk, left, right };

/// Something that a link looks like.
struct LinkShape {
  int link = 0;
  BodyPart part = BodyPart::trunk;
  bool sole = false;  ///< of the biped's rectangle, where the file has no shapes
  Eigen::Isometry3d X_LP = Eigen::Isometry3d::Identity();  ///< its middle
  Eigen::Vector3d edges_m = Eigen::Vector3d::Zero();       ///< of a box
  double radius_m = 0.0;  ///< of a ball, or of a rod along z of P; 0: a box
  double length_m = 0.0;  ///< of a rod; 0: a ball
};

/// Boxes, balls and cylinders by which a URDF draws the links. Of a file that has none but meshes:
/// rods from joint to joint, and soles. @throws ConfigError if the URDF cannot be read
std::vector<LinkShape> link_shapes(const Biped& biped, const std::string& urdf_file);

}  // namespace mimesis::robot
