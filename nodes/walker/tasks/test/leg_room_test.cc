#include "nodes/walker/tasks/leg_room.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/testing/no_malloc.h"
#include "nodes/walker/tasks/test/reference.h"

namespace mimesis::walker {
namespace {

constexpr double kDt = 0.005, kKnee = 0.01;  // what knees may go within a tick [rad]

/// A robot that sits half with its knees bent by so much more or less.
class LegRoomTest : public ::testing::TestWithParam<robot::Biped> {
 protected:
  LegRoomTest() : kinematics(GetParam().tree), q(GetParam().half_sitting), room(GetParam()) {
    lower = upper = Eigen::VectorXd::Zero(6 + q.size());
    for (const Side side : robot::kSides) {
      lower[6 + knee(side)] = -kKnee;
      upper[6 + knee(side)] = kKnee;
    }
  }
  int knee(Side side) const { return GetParam().leg[side].dof[3]; }
  int link(Side side, std::size_t joint) const {
    const auto& tree = GetParam().tree;
    return tree.require_link(tree.moved(GetParam().leg[side].dof[joint]).name);
  }
  /// From the ankle to the hip, knees `more` rad nearer to stretched.
  Eigen::Vector3d way(Side side, double more) {
    Eigen::VectorXd posture = q;
    posture[knee(side)] += room.straight_rad(side) > q[knee(side)] ? more : -more;
    kinematics.update(Eigen::Isometry3d::Identity(), posture);
    const Eigen::Vector3d p =
        kinematics.X_WL(link(side, 2)).translation() - kinematics.X_WL(link(side, 4)).translation();
    kinematics.update(Eigen::Isometry3d::Identity(), q);
    return p;
  }
  /// Rise of a hip above its ankle until the leg is as long as with the knee `more` stretched.
  double rise_of(Side side, double more, const Eigen::Vector2d& along = Eigen::Vector2d::Zero()) {
    Eigen::Vector3d from = way(side, 0.0);
    from.head<2>() += along;
    const double length = way(side, more).norm();
    return std::sqrt(length * length - from.head<2>().squaredNorm()) - from.z();
  }
  double ask(const Eigen::Vector3d& com, const Eigen::Vector3d& feet = Eigen::Vector3d::Zero()) {
    kinematics.update(Eigen::Isometry3d::Identity(), q);
    return room.rise_m({.kinematics = kinematics,
                        .q = q,
                        .lower = lower,
                        .upper = upper,
                        .com_W_m = Eigen::Vector3d::Zero(),
                        .com_way_m = com,
                        .feet_way_m = {feet, feet},
                        .dt_s = kDt});
  }

  robot::Kinematics kinematics;
  Eigen::VectorXd q, lower, upper;
  LegRoom room;
};

TEST_P(LegRoomTest, PassesWhatTheKneesCan) {
  for (const double wished : {0.0, 1e-4, -1e-4, 3e-4}) {
    EXPECT_EQ(ask({1e-4, 2e-4, wished}), wished);
    EXPECT_EQ(room.missing_m(), 0.0);
  }
}

TEST_P(LegRoomTest, RisesAndFallsAsFarAsTheKneesMayGo) {
  const double most = std::min(rise_of(kLeft, 0.9 * kKnee), rise_of(kRight, 0.9 * kKnee)),
               least = std::max(rise_of(kLeft, -0.9 * kKnee), rise_of(kRight, -0.9 * kKnee));
  EXPECT_GT(most, 5e-4);
  EXPECT_NEAR(ask({0.0, 0.0, -1.0}), least, 1e-12);
  room.reset();
  EXPECT_NEAR(ask({0.0, 0.0, 1.0}), most, 1e-12);
  EXPECT_NEAR(room.missing_m(), 1.0 - most, 1e-12);
}

TEST_P(LegRoomTest, FeetAndTheWayOnTheGroundCount) {
  const Eigen::Vector2d along(0.004, 0.0);
  const double most =
      std::min(rise_of(kLeft, 0.9 * kKnee, along), rise_of(kRight, 0.9 * kKnee, along));
  EXPECT_NEAR(ask({along.x(), 0.0, 1.0}), most, 1e-12);
  room.reset();
  EXPECT_NEAR(ask({0.0, 0.0, 1.0}, {-along.x(), 0.0, 0.002}), most + 0.002, 1e-12);
}

TEST_P(LegRoomTest, AStretchedLegKeepsTheHeightAndBendsWithABoundedAcceleration) {
  for (const Side side : robot::kSides) {
    const double straight = room.straight_rad(side);
    q[knee(side)] = straight + std::copysign(0.02, q[knee(side)] - straight);
    lower[6 + knee(side)] = q[knee(side)] > straight ? 0.0 : -kKnee;  // no further
    upper[6 + knee(side)] = q[knee(side)] > straight ? kKnee : 0.0;
  }
  EXPECT_NEAR(ask({0.0, 0.0, 0.02}), 0.0, 1e-12);
  // 100 rad/s²: by 2.5 mrad in the first tick, by 5 mrad in the next one, and so on.
  for (int tick = 1; tick <= 3; ++tick) {
    const double bend = -100.0 * kDt * kDt * tick;
    const double least = std::max(rise_of(kLeft, bend), rise_of(kRight, bend));
    EXPECT_NEAR(ask({0.0, 0.0, -0.02}), least, 1e-9) << tick;
    EXPECT_LT(least, 0.0);
  }
}

TEST_P(LegRoomTest, WhatTheCoMHasIsNotTakenFromIt) {
  for (const Side side : robot::kSides) lower[6 + knee(side)] = upper[6 + knee(side)] = 0.0;
  EXPECT_LT(std::min(rise_of(kLeft, 0.0, {0.1, 0.0}), rise_of(kRight, 0.0, {0.1, 0.0})), -1e-3);
  EXPECT_EQ(ask({0.1, 0.0, 0.0}), 0.0);
}

TEST_P(LegRoomTest, DoesNotAllocate) {
  ask({0.0, 0.0, 1.0});
  const testing::NoMalloc guard;
  ask({0.0, 0.0, -1.0});
}

INSTANTIATE_TEST_SUITE_P(Robots, LegRoomTest, ::testing::ValuesIn(robots()),
                         [](const auto& robot) { return robot.param.tree.name(); });

}  // namespace
}  // namespace mimesis::walker
