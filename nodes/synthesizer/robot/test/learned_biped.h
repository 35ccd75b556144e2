#pragma once
#include "common/model/files.h"
#include "nodes/synthesizer/robot/biped_sequence.h"

namespace mimesis::synthesizer::testing {

/// models/biped.yaml, learned once a program: 4 + 3 sources.
inline const robot::Biped& described_biped() {
  static const robot::Biped biped = model::load_biped("biped.yaml");
  return biped;
}
inline const robot::RobotTree& biped_tree() { return described_biped().tree; }
inline const DrawerData& biped_data() {
  static const DrawerData data = generate_robot_data(described_biped(), {});
  return data;
}
inline const BipedDrawer& biped_drawer() {
  static const BipedDrawer learned = make_biped_drawer(described_biped(), biped_data());
  return learned;
}

}  // namespace mimesis::synthesizer::testing
