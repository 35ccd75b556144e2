#pragma once
#include <chrono>
#include <span>

#include "nodes/crowd/run/observer.h"
#include "proto/foxglove/scene.pb.h"

namespace mimesis::crowd {

/// What viewers of logs draw, in frame "world": a stroke along the heading of every agent in the
/// colour of its group, discs too if there are not too many; pillars, walls and common goals.
foxglove::SceneUpdate paint(const Scenario& scenario, std::span<const Observed> agents,
                            std::chrono::nanoseconds stamp);

}  // namespace mimesis::crowd
