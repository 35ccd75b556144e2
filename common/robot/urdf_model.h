#pragma once
#include <urdf_model/model.h>
#include <urdf_world/types.h>

#include <Eigen/Geometry>
#include <string>

namespace mimesis::robot {

/// A URDF file as urdfdom reads it. @throws ConfigError "FILE: what, expected ..." in one line
urdf::ModelInterfaceSharedPtr parse_urdf(const std::string& file);

inline Eigen::Vector3d vector_of(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }  ///< [m]
Eigen::Isometry3d pose_of(const urdf::Pose& p);  ///< places in m

}  // namespace mimesis::robot
