#pragma once
#include <Eigen/Geometry>
#include <chrono>

#include "common/model/drawing.h"
#include "nodes/vision/table_watcher.h"
#include "proto/foxglove/scene.pb.h"

namespace mimesis::vision {

/// The colour of a kind of things in all drawings.
const model::Rgba& color_of(Kind kind);

/// What two cameras see of a table, in frame W: entity "things", bodies as they were measured, each
/// with an ellipsoid of three standard deviations of its centre; entity "hand", the capsules of the
/// hand model, while it follows a hand. With one camera there is nothing to draw.
/// @param X_WT  frame T in W
foxglove::SceneUpdate draw_sight(const TableWatcher& watcher, const Eigen::Isometry3d& X_WT,
                                 std::chrono::nanoseconds stamp);

}  // namespace mimesis::vision
