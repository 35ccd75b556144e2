#pragma once
#include <string>

#include "common/model/files.h"

namespace mimesis::tool {

/// `text` as a YAML scalar: in quotes unless it is a plain name.
std::string yaml_word(const std::string& text);

/// Groups, checks and balls as an arm's file gives them.
std::string cover_text(const model::CoveredArm& covered);

}  // namespace mimesis::tool
