#pragma once
#include <chrono>
#include <span>
#include <string>

#include "nodes/crowd/external/external_agents.h"
#include "nodes/crowd/run/scenario_run.h"
#include "nodes/crowd/run/watch.h"
#include "proto/crowd.pb.h"
#include "proto/foxglove/scene.pb.h"

namespace mimesis::crowd {

/// Names the fault of a message of many walkers, or empty: lists of different lengths, numbers that
/// are no state, groups that the scenario has not.
std::string fault(const v1::CrowdStates& states, const Scenario& scenario);

/// All agents of the run.
void to_proto(const ScenarioRun& run, v1::CrowdStates& states);

/// Agent i of a message. Precondition: no fault.
AgentReport to_report(const v1::CrowdStates& states, int i);
AgentState to_state(const AgentReport& report);

v1::CrowdInfo to_info(const ScenarioRun& run);
v1::CrowdTrust to_proto(Trust trust);

/// Picture for viewers of logs, in frame "world": a stroke along the heading of every agent in the
/// colour of its group, discs too if there are not too many; pillars, walls and common goals.
foxglove::SceneUpdate paint(const Scenario& scenario, std::span<const Observed> agents,
                            std::chrono::nanoseconds stamp);

}  // namespace mimesis::crowd
