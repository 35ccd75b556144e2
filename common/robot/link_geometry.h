#pragma once
#include <map>
#include <string>
#include <vector>

#include "common/robot/cover_balls.h"

namespace mimesis::robot {

/// What a URDF says of the shape of a link.
struct LinkParts {
  bool collision = false, visual = false;  ///< it has such elements
};

/// Of all links of a URDF; reads no mesh. @throws ConfigError as below
std::map<std::string, LinkParts> link_parts(const std::string& urdf_file);

/// Solids of the `<collision>` elements of these links of a URDF; links without any are left out.
/// Meshes may be STL, OBJ, Collada and whatever else assimp reads;
/// a Collada file's up axis is ignored, as in ROS, its unit is not. "package://NAME/PATH" is PATH
/// in the folder NAME that holds the URDF or lies in a folder around it, or in one of
/// $ROS_PACKAGE_PATH; other names count from the URDF's folder.
/// @param use_visual  links without `<collision>` have the solids of their `<visual>`
/// @throws ConfigError "FILE: link 'L': what, expected ..." in one line
std::map<std::string, std::vector<Solid>> link_solids(const std::string& urdf_file,
                                                      const std::vector<std::string>& links,
                                                      bool use_visual = false);

}  // namespace mimesis::robot
