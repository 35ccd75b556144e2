#pragma once
#include <string>

#include "common/robot/biped.h"

namespace mimesis::hw::sim {

inline std::string biped_urdf() { return std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf"; }

robot::Biped hrp2_like();

}  // namespace mimesis::hw::sim
