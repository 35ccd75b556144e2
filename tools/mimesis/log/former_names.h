#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "proto/steps.pb.h"

// The names that older versions gave to ports, services, parameters and model files, so that their
// logs can be replayed.
namespace mimesis::tool {

/// Gives a recorded start of a node the names of this version.
/// @return what was renamed or is left out, one line each
std::vector<std::string> rename_former(v1::NodeStart& start);

/// The same for recorded steps of a node. @param program  its NodeStart.executable
void rename_former(std::string_view program, v1::StepLog& steps);

}  // namespace mimesis::tool
