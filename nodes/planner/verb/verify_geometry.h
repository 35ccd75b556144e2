#pragma once
#include <string>
#include <vector>

#include "common/model/files.h"

namespace mimesis::tool {

/// What of a URDF's geometry no part or ball of the arm holds, a line for each link; read again
/// from the XML and its meshes by code of its own. Of the base and of links that the arm moves, and
/// of those that it has parts of; not of those that its file excuses. A triangle is held if all its
/// corners are in one part; else it is halved, down to a millimetre, where corners may be in
/// different ones.
std::vector<std::string> geometry_gaps(const model::CoveredArm& arm);

}  // namespace mimesis::tool
