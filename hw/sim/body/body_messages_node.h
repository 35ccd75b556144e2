#pragma once
#include "hw/sim/body/body_world.h"
#include "hw/sim/body/drawer.h"
#include "proto/foxglove/transform.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::hw::sim {

// Without headers, into messages that are kept from step to step.
void to_proto(const BodySensors& sensors, v1::BodySensors& out);
void to_proto(const BodyTruth& truth, const Eigen::VectorXd& torque_n_m, v1::BodyTruth& out);
void to_proto(const DrawerNow& drawer, const BodyTruth& truth, v1::DrawerState& out);
/// Pose of link `child` in the world, for viewers.
foxglove::FrameTransform to_transform(const Eigen::Isometry3d& X_WB, const std::string& child);

}  // namespace mimesis::hw::sim
