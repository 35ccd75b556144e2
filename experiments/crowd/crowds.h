#pragma once
#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {

/// Two streams that cross at right angles, 0.25 agents/m², every agent on a lane, steps in
/// synchrony by mean field, spacing by step frequency and length: every rule at once. Steps of 1/60
/// s.
Crowd crossing_crowd(int n);

/// Everybody to the opposite place of a disc, 0.25 agents/m².
Crowd circle_crowd(int n);

/// A formation without navigation: rules I, II and III by mean fields.
Crowd formation_crowd(int n);

/// On a circle of 40 m, every agent to the opposite place. Steps of 20 ms, like the next ones.
Crowd ring_crowd(int n);

/// Pairs 10 m apart that change places, exactly head on.
Crowd head_on_crowd(int pairs);

/// Agents within a distance of their goals.
int arrived(const Crowd& crowd, double within_m);

}  // namespace mimesis::crowd
