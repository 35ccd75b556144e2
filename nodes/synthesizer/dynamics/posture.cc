#include "nodes/synthesizer/dynamics/posture.h"

#include "common/math/vector_clones.h"
#include "nodes/synthesizer/dynamics/posture_lanes.h"

namespace mimesis::synthesizer {
namespace {

Vec3 to_lane(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

}  // namespace

BodyLanes::BodyLanes(const mocap::Body& body) {
  for (std::size_t j = 0; j < mocap::kBodyJoints; ++j) offset[j] = to_lane(body.offset_m[j]);
  for (std::size_t side = 0; side < 2; ++side) {
    foot[2 * side] = to_lane(body.heel_m[side]);
    foot[2 * side + 1] = to_lane(body.toe_m[side]);
  }
}

MIMESIS_VECTOR_CLONES
void posture(const BodyLanes& body, const Lane* angle, RotationLanes& rotation, PointLanes& point) {
  posture_lanes(body, angle, rotation, point);
}

}  // namespace mimesis::synthesizer
