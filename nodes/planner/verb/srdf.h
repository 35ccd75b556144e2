#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

#include "common/robot/robot_tree.h"

namespace mimesis::tool {

/// What an SRDF, MoveIt's companion of a URDF, says of arms: which joints are one, named postures,
/// and links that may touch.
struct Srdf {
  struct Chain {
    std::string base, tip;  ///< links
    std::string fault{};    ///< why it is none: "FILE:LINE: joint 'a', expected ..."; empty: it is
  };
  struct State {
    std::string name, group;
    std::map<std::string, double> joints;  ///< [rad] or [m]
  };
  struct Pair {
    std::array<std::string, 2> links;
    std::string reason;
  };
  std::map<std::string, Chain> chains;  ///< of groups that are one, by `<chain>` or by their joints
  std::vector<State> states;
  std::vector<Pair> disabled;
};

/// Groups may name what this robot lacks, as those of another hand do: they are no chains then.
/// @throws ConfigError "FILE:LINE: what, expected ..." in one line
Srdf read_srdf(const std::string& file, const robot::RobotTree& tree);

}  // namespace mimesis::tool
