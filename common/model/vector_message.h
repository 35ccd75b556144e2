#pragma once
#include <Eigen/Core>

#include "proto/scene.pb.h"

namespace mimesis::model {

/// Places on the wire [m].
inline Eigen::Vector3d to_eigen(const v1::Vector3& v) { return {v.x_m(), v.y_m(), v.z_m()}; }
/// The other way.
inline void to_proto(const Eigen::Vector3d& v, v1::Vector3& out) {
  out.set_x_m(v.x());
  out.set_y_m(v.y());
  out.set_z_m(v.z());
}

}  // namespace mimesis::model
