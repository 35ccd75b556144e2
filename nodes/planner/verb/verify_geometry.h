#pragma once
#include <string>
#include <vector>

#include "common/model/files.h"
#include "nodes/planner/verb/plan_file.h"

namespace mimesis::tool {

/// What of a URDF's geometry no part or ball of the arm holds, a line for each link; read again
/// from the XML and its meshes by code of its own. Of the base and of links that the arm moves, and
/// of those that it has parts of; not of those that its file excuses. A triangle is held if all its
/// corners are in one part; else it is halved, down to a millimetre, where corners may be in
/// different ones.
std::vector<std::string> geometry_gaps(const model::CoveredArm& arm);

/// The arm's file, its URDF, and the meshes of the links above, as they are now.
std::vector<PlanInput> inputs_of(const std::string& robot, const model::CoveredArm& arm);
/// How the inputs of now differ from those of a plan, a line each.
std::vector<std::string> changed_inputs(const PlanFile& plan, const std::vector<PlanInput>& now);

}  // namespace mimesis::tool
