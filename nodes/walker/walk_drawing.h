#pragma once
#include <chrono>

#include "common/robot/biped.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::walker {

/// The plan for viewers, in W: where the soles are and where the next one lands; the planned CoM
/// and its place on the ground; the zero moment point planned, wished and measured.
/// @param balance  null: none of these
foxglove::SceneUpdate draw_plan(const v1::WalkFeedback& feedback, const v1::WalkBalance* balance,
                                const robot::Biped& biped, std::chrono::nanoseconds now);

}  // namespace mimesis::walker
