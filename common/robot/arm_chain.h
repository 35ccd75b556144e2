#pragma once
#include <string>
#include <utility>
#include <vector>

#include "common/robot/robot_tree.h"

namespace mimesis::robot {

/// The arm in a robot: the joints between two links, and where the others stay.
struct ArmChain {
  std::string base, tip;
  std::vector<int> joints;  ///< by the links that they carry, indices into the tree, base first
  /// Joints beside the chain that its links carry (a gripper's, another arm's), and their positions
  /// [rad] or [m]: 0, or the limit nearest to it. Those that follow others are left out.
  std::vector<std::pair<std::string, double>> fixed;
};

/// @param base  empty: the root
/// @param tip   empty: the end of the longest chain, without the fingers on it; of what is fixed to
///              it, the carrier of the fingers, a link named as tools are (tool0, tcp), or none
/// @throws ConfigError if there is no such link or no joint, or that names the tips of equally
///         long chains
ArmChain find_arm_chain(const RobotTree& tree, const std::string& base = {},
                        const std::string& tip = {});

}  // namespace mimesis::robot
