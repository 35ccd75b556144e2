#pragma once
#include "common/kin/arm.h"

namespace mimesis::planner {

/// Planar 2-DoF arm, links of 1.0 and 0.8 m, covered with balls every 0.1 m [M18 fig. 2.7].
inline kin::ArmModel planar_arm() {
  kin::ArmModel arm;
  arm.name = "planar";
  arm.links = {{1.0, 0.0, 0.0, 0.0}, {0.8, 0.0, 0.0, 0.0}};
  arm.q_min = Eigen::Vector2d(-2.9, -2.7);
  arm.q_max = Eigen::Vector2d(2.9, 2.7);
  arm.v_max = Eigen::Vector2d(1.0, 2.0);
  arm.a_max = Eigen::Vector2d(3.0, 4.0);
  arm.home = Eigen::Vector2d::Zero();
  arm.groups = {"upper", "fore"};
  for (int i = 1; i <= 10; ++i) arm.balls.push_back({1, 0, {-1.0 + 0.1 * i, 0.0, 0.0}, 0.06});
  for (int i = 1; i <= 8; ++i) arm.balls.push_back({2, 1, {-0.8 + 0.1 * i, 0.0, 0.0}, 0.06});
  arm.env_groups = {0, 1};
  return arm;
}

}  // namespace mimesis::planner
