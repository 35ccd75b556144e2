#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/kin/arm.h"
#include "common/robot/cover_balls.h"

namespace mimesis::model {

/// Safety balls of an arm's link in one group: arm.balls[begin .. end).
struct LinkBalls {
  std::string link;  ///< of the URDF; "frame 3" of an arm without
  int group = 0;
  std::size_t begin = 0, end = 0;
  bool fitted = false;                        ///< else they are the file's own
  std::vector<robot::CoverBall> balls{};      ///< in the link's frame
  std::optional<robot::OverCoverage> over{};  ///< if the link has collision geometry
};

struct CoveredArm {
  kin::ArmModel arm;
  std::vector<LinkBalls> links;
  /// Groups of fitted links that are not checked against each other, as their balls touch at home.
  std::vector<std::pair<std::string, std::string>> touching_at_home;
};

/// Reads an arm as load_arm does, and compares its balls with the geometry of its URDF.
CoveredArm load_covered_arm(const std::string& file);

}  // namespace mimesis::model
