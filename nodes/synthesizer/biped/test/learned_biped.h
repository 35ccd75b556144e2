#pragma once
#include "nodes/synthesizer/biped/biped_sequence.h"

namespace mimesis::synthesizer::testing {

/// Of biped.urdf, learned once a program: 4 + 3 sources.
inline const robot::RobotTree& biped_tree() {
  static const robot::RobotTree tree = robot::read_urdf(MIMESIS_SOURCE_DIR "/models/biped.urdf");
  return tree;
}
inline const DrawerData& biped_data() {
  static const DrawerData data =
      generate_robot_data(biped_tree(), retarget::biped_figure(), robot_drawer(), {});
  return data;
}
inline const BipedDrawer& biped_drawer() {
  static const BipedDrawer learned =
      make_biped_drawer(biped_tree(), retarget::biped_figure(), biped_data());
  return learned;
}

}  // namespace mimesis::synthesizer::testing
