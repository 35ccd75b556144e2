#pragma once
#include <string>

namespace mimesis::tool {

/// `mimesis log info`: prints what the file holds. Returns the exit code.
int log_info(const std::string& path, bool json);

}  // namespace mimesis::tool
