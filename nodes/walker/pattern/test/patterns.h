#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>

#include "nodes/walker/pattern/mpc_problem.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/pattern/preview_control.h"

namespace mimesis::walker::testing {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// One way of making patterns, with its tolerances.
struct Kind {
  const char* name;
  std::function<std::unique_ptr<PatternGenerator>(const GaitSettings&)> make;
  double zmp_beyond_m;       // ZMP beyond its rectangle, between samples or for lack of limits
  double preview_m;          // error of the CoM against its preview 0.7 s before
  bool places_feet_in_time;  // a landing may change after its swing has begun
};

inline std::ostream& operator<<(std::ostream& out, const Kind& kind) { return out << kind.name; }

inline Wish forward(double m_s) {
  Wish wish;
  wish.velocity_m_s = {m_s, 0.0};
  return wish;
}

inline Wish stop() {
  Wish wish;
  wish.walk = false;
  return wish;
}

inline Footprint ground_pose(const FootState& foot, Side side) {
  const Eigen::Matrix3d& R = foot.X_WS.linear();
  return {side, foot.X_WS.translation().head<2>(), std::atan2(R(1, 0), R(0, 0))};
}

/// Conditions that hold at every tick for every wish.
class Watch {
 public:
  explicit Watch(const GaitSettings& gait) : gait_(gait), footsteps_(gait) { sides_.reserve(8); }

  void look(const PatternSample& s) {
    ASSERT_TRUE(s.com.p_W_m.allFinite() && s.zmp_W_m.allFinite());
    const std::array<Footprint, 2> feet = {ground_pose(s.foot[kLeft], kLeft),
                                           ground_pose(s.foot[kRight], kRight)};
    const Footprint& a = s.contact[kLeft] ? feet[kLeft] : feet[kRight];
    const Footprint& b = s.contact[kRight] ? feet[kRight] : feet[kLeft];
    support_polygon(a, b, gait_.zmp_half_m, sides_);
    for (const HalfPlane& side : sides_)
      zmp_beyond_m = std::max(zmp_beyond_m, side.normal.dot(s.zmp_W_m) - side.offset);
    EXPECT_NEAR((s.zmp_W_m - (s.com.p_W_m - gait_.com_height_m / 9.81 * s.com.a_W)).norm(), 0.0,
                1e-12);
    // a foot that has landed, as seen from the one before
    const Side landed = robot::other(s.swing);
    const Footprint& from = feet[s.swing];
    const Eigen::Vector2d step = rotation(-from.yaw_rad) * (feet[landed].p_W_m - from.p_W_m);
    if (any_ && s.steps > last_.steps) {
      narrowest_m = std::min(narrowest_m, robot::sign(landed) * step.y());
      step_beyond_m = std::max(step_beyond_m, footsteps_.beyond(landed, step));
    }
    closest_m = std::min(closest_m, step.norm());
    com_from_stance_m = std::max(com_from_stance_m, (s.com.p_W_m - feet[landed].p_W_m).norm());
    if (any_) compare(last_, s);
    last_ = s;
    any_ = true;
  }

  double zmp_beyond_m = -1.0, narrowest_m = 1.0, closest_m = 1.0, step_beyond_m = -1.0,
         com_from_stance_m = 0.0;
  double com_jump_m = 0.0, com_speed_jump = 0.0, foot_jump_m = 0.0, foot_acceleration = 0.0,
         foot_speed_jump = 0.0, yaw_jump_rad = 0.0, yaw_acceleration = 0.0, lowest_m = 0.0;

 private:
  void compare(const PatternSample& before, const PatternSample& s) {
    const auto keep = [](double& worst, double value) { worst = std::max(worst, value); };
    // difference from constant acceleration over a tick
    keep(com_jump_m,
         (s.com.p_W_m - before.com.p_W_m - kTick_s / 2.0 * (before.com.v_W + s.com.v_W)).norm());
    keep(com_speed_jump,
         (s.com.v_W - before.com.v_W - kTick_s / 2.0 * (before.com.a_W + s.com.a_W)).norm());
    for (const Side side : robot::kSides) {
      const FootState &f = s.foot[side], &g = before.foot[side];
      keep(foot_jump_m,
           (f.X_WS.translation() - g.X_WS.translation() - kTick_s / 2.0 * (f.v_W + g.v_W)).norm());
      keep(foot_speed_jump, (f.v_W - g.v_W - kTick_s / 2.0 * (f.a_W + g.a_W)).norm());
      keep(foot_acceleration, f.a_W.norm());
      keep(yaw_acceleration, std::abs(f.yaw_acceleration));
      const double dyaw = ground_pose(f, side).yaw_rad - ground_pose(g, side).yaw_rad;
      keep(yaw_jump_rad, std::abs(std::remainder(dyaw, 2.0 * M_PI) -
                                  kTick_s / 2.0 * (f.yaw_rate_rad_s + g.yaw_rate_rad_s)));
      lowest_m = std::min(lowest_m, f.X_WS.translation().z());
    }
  }

  GaitSettings gait_;
  Footsteps footsteps_;
  std::vector<HalfPlane> sides_;
  PatternSample last_;
  bool any_ = false;
};

/// Every test of it runs with every kind.
class Patterns : public ::testing::TestWithParam<Kind> {
 protected:
  std::unique_ptr<PatternGenerator> make(const GaitSettings& gait = {}) {
    return GetParam().make(gait);
  }
  static void run(PatternGenerator& pattern, const Wish& wish, int ticks) {
    for (int i = 0; i < ticks; ++i) pattern.step(wish);
  }
};

inline void expect_all_right(const Watch& watch, const Kind& kind, const GaitSettings& gait) {
  EXPECT_LT(watch.zmp_beyond_m, kind.zmp_beyond_m);
  EXPECT_GT(watch.narrowest_m, gait.narrowest_step_m - 1e-6);
  EXPECT_GT(watch.closest_m, gait.narrowest_step_m - 0.03);  // in the air, feet turned
  EXPECT_LT(watch.step_beyond_m, 1e-6);
  EXPECT_LT(watch.com_from_stance_m, 0.35);
  EXPECT_LT(watch.com_jump_m, 2e-5);
  EXPECT_LT(watch.com_speed_jump, 2e-3);
  EXPECT_LT(watch.foot_jump_m, 2e-5);
  EXPECT_LT(watch.foot_speed_jump, 2e-2);
  EXPECT_LT(watch.foot_acceleration, 30.0);
  EXPECT_LT(watch.yaw_jump_rad, 2e-5);
  EXPECT_LT(watch.yaw_acceleration, 30.0);
  EXPECT_GE(watch.lowest_m, 0.0);
}

}  // namespace mimesis::walker::testing
