#include "common/motion/retarget/posture_ik.h"

#include <gtest/gtest.h>

namespace mimesis::retarget {
namespace {

/// Four hinges about y with 0.3 m between them, the second one within ±0.5 rad.
robot::RobotTree arm() {
  std::vector<robot::Link> links(6);
  for (int i = 0; i < 6; ++i) {
    robot::Link& link = links[static_cast<std::size_t>(i)];
    link.name = "link" + std::to_string(i);
    link.parent = i - 1;
    if (i == 0) continue;
    link.joint = "joint" + std::to_string(i);
    link.X_PJ.translation().x() = i == 1 ? 0.0 : 0.3;
    if (i == 5) continue;  // the hand
    link.type = robot::JointType::revolute;
    link.axis = Eigen::Vector3d::UnitY();
    link.upper = i == 2 ? 0.5 : 3.0;
    link.lower = -link.upper;
    link.max_speed = 1.0;
  }
  return {"arm", links};
}

TEST(PostureIk, AJointAtItsLimitIsLeftOutOfTheStep) {
  // Wishes pull the second joint beyond its limit, where it stands. A step that counts on it and is
  // clamped afterwards moves the hand away again and again.
  const robot::RobotTree tree = arm();
  robot::Kinematics k(tree);
  Posture start;
  start.q = Eigen::Vector4d(0.2, 0.5, 0.4, 0.3);
  std::vector<Goal> exact(2), wishes(2);
  k.update(start.X_WB, start.q);
  exact[1].link = 5;
  exact[1].X_WE = k.X_WL(5);
  exact[1].orientation_weight = 0.0;
  k.update(start.X_WB, Eigen::Vector4d(0.2, 0.9, 0.0, 0.0));
  for (const int i : {1, 2}) {
    Goal& wish = wishes[static_cast<std::size_t>(i - 1)];
    wish.link = i;
    wish.X_WE = k.X_WL(i);
    wish.position_weight = 0.0;
  }
  const IkResult result = solve(k, start, exact, wishes);
  EXPECT_LT(result.exact_error, 1e-8);
  EXPECT_NEAR(result.posture.q[1], 0.5, 0.01);  // as near as the barrier lets it be
}

}  // namespace
}  // namespace mimesis::retarget
