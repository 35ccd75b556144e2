#pragma once
#include <cstdint>
#include <string>

#include "common/kin/arm.h"
#include "nodes/planner/roadmap.h"

namespace mimesis::planner {

/// The part of a roadmap that belongs to the arm alone: its nodes do not touch the arm itself.
/// Obstacles come when it is used (refreshed_roadmap).
Roadmap arm_roadmap(const kin::ArmModel& arm, const RoadmapSettings& settings, double margin_m);

/// A number that changes with whatever of the arm such a roadmap depends on: links, tool, limits of
/// the angles, safety balls, and the pairs of groups that must not touch.
std::uint64_t arm_hash(const kin::ArmModel& arm);

/// Little-endian, in this order: "MIMROAD1"; u64 arm_hash; u32 n, N; n × N f64 nodes [rad]; for
/// each node u32 the number of its links, then for each u32 the other end; u64 hash of all before.
/// @throws ConfigError if the file cannot be written.
void save_roadmap(const Roadmap& roadmap, const kin::ArmModel& arm, const std::string& file);

/// @throws ConfigError "FILE: ..." if it is not whole, or of another arm.
Roadmap load_roadmap(const std::string& file, const kin::ArmModel& arm);

}  // namespace mimesis::planner
