#pragma once
#include <chrono>
#include <span>
#include <string>

#include "nodes/crowd/external/external_agents.h"
#include "nodes/crowd/regions/far_crowd.h"
#include "nodes/crowd/run/scenario_run.h"
#include "nodes/crowd/run/watch.h"
#include "proto/crowd.pb.h"
#include "proto/foxglove/scene.pb.h"

namespace mimesis::crowd {

/// Names the fault of a message of many walkers, or empty: lists of different lengths, numbers that
/// are no state, groups that the scenario has not.
/// @param coordinators  number of them, if the message is of one
std::string fault(const v1::CrowdStates& states, const Scenario& scenario, int coordinators = 0);
std::string fault(const v1::CrowdHandover& handover, const ScenarioRun& run, int coordinators);

/// The agents that the run moves itself, external ones among them, and their sums.
void to_proto(const ScenarioRun& run, v1::CrowdStates& states);
/// What a coordinator says about the ownership of the agents in `states`.
void to_proto(const OwnershipReport& report, v1::CrowdStates& states);

/// Precondition: no fault.
FarReport to_far(const v1::CrowdStates& states, const Roster& roster);
/// Agent i of a message. Precondition: no fault.
AgentReport to_report(const v1::CrowdStates& states, int i);
AgentState to_state(const AgentReport& report);

void to_proto(const Traveller& traveller, v1::CrowdTraveller& out);
/// Offers of one coordinator to another, all of the same time.
void to_proto(std::span<const Passing> passing, v1::CrowdHandover& out);
/// Precondition: no fault.
std::vector<Passing> from_proto(const v1::CrowdHandover& in);

v1::CrowdInfo to_info(const ScenarioRun& run, int coordinators);
v1::CrowdTrust to_proto(Trust trust);

/// Picture for viewers of logs, in frame "world": a stroke along the heading of every agent in the
/// colour of its group, discs too if there are not too many; pillars, walls and common goals.
foxglove::SceneUpdate paint(const Scenario& scenario, std::span<const Observed> agents,
                            std::chrono::nanoseconds stamp);

}  // namespace mimesis::crowd
