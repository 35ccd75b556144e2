#pragma once
#include <string>
#include <utility>
#include <vector>

#include "common/model/files.h"

namespace mimesis::tool {

/// Groups that are checked against each other, but touch at the arm's home.
std::vector<std::pair<std::string, std::string>> touching_at_home(const model::CoveredArm& covered);
/// A line for each pair that always touches, or does at home.
std::string touching_text(const model::CoveredArm& covered);

/// Groups, checks, balls and parts as an arm's file gives them.
std::string cover_text(const model::CoveredArm& covered);

}  // namespace mimesis::tool
