#pragma once
#include <string>

namespace mimesis::model {

inline constexpr double kLeastRate_hz = 10.0, kMostRate_hz = 1000.0;  ///< of commands to joints

/// Path of the URDF `urdf_name` that the file `path` names. @throws ConfigError if there is none
std::string urdf_of(const std::string& path, const std::string& urdf_name);

}  // namespace mimesis::model
