#pragma once
#include <string>
#include <vector>

#include "proto/runtime.pb.h"

namespace mimesis::runtime {

/// One line for every topic on which `self` and `other` are wired together with different types.
/// Symmetric: both nodes find the same pairs.
std::vector<std::string> mismatches(const v1::NodeInfo& self, const v1::NodeInfo& other);

}  // namespace mimesis::runtime
