#pragma once
#include "common/model/drawing.h"
#include "proto/cognition.pb.h"
#include "tools/mimesis/log/view_drawing.h"

namespace mimesis::tool {

/// Activity u(x) of all fields as curves on a board that stands left of the robot's table, in the
/// plane y = 1.25 m of W: x along the board, the first field on top, a grey line at u = 0. One
/// entity, replaced by every message.
foxglove::SceneUpdate to_board(const v1::FieldActivity& fields);

/// Colour of a point of activity u: blue at rest, grey at 0, orange when active.
model::Rgba activity_color(double u);

}  // namespace mimesis::tool
