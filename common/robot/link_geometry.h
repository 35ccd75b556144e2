#pragma once
#include <map>
#include <string>
#include <vector>

#include "common/robot/cover_balls.h"

namespace mimesis::robot {

/// The shape of a link, as its URDF tells it.
struct LinkGeometry {
  std::vector<Solid> solids;  ///< of its `<collision>` elements
  bool seen = false;          ///< it has `<visual>` elements
};

/// Shapes of these links of a URDF. Meshes may be STL, OBJ, Collada and whatever else assimp reads;
/// a Collada file's up axis is ignored, as in ROS, its unit is not. "package://NAME/PATH" is PATH
/// in the folder NAME that holds the URDF or lies in a folder around it, or in one of
/// $ROS_PACKAGE_PATH; other names count from the URDF's folder.
/// @param use_visual  links without `<collision>` have the solids of their `<visual>`
/// @throws ConfigError "FILE: link 'L': what, expected ..." in one line
std::map<std::string, LinkGeometry> link_geometry(const std::string& urdf_file,
                                                  const std::vector<std::string>& links,
                                                  bool use_visual = false);

}  // namespace mimesis::robot
