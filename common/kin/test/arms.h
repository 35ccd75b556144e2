#pragma once
#include "common/kin/arm.h"

namespace mimesis::kin {

/// Two links of 1.0 m and 0.8 m in the x-y plane.
inline ArmModel planar_arm() {
  ArmModel arm;
  arm.links = {{.a = 1.0}, {.a = 0.8}};
  arm.q_min = Eigen::Vector2d::Constant(-3.0);
  arm.q_max = Eigen::Vector2d::Constant(3.0);
  return arm;
}

/// Geometry and joint limits of models/lwr4.yaml.
inline ArmModel lwr4() {
  constexpr double kRight = M_PI / 2;
  ArmModel arm;
  arm.links = {{.alpha = kRight, .d = 0.31},
               {.alpha = -kRight},
               {.alpha = -kRight, .d = 0.4},
               {.alpha = kRight},
               {.alpha = kRight, .d = 0.39},
               {.alpha = -kRight},
               {.d = 0.078}};
  arm.X_LE.translation() << 0.0, 0.0, 0.16;
  arm.q_max.resize(7);
  arm.q_max << 170, 120, 170, 120, 170, 120, 170;
  arm.q_max *= M_PI / 180.0;
  arm.q_min = -arm.q_max;
  return arm;
}

}  // namespace mimesis::kin
