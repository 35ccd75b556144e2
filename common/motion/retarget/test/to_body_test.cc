#include "common/motion/retarget/to_body.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/motion/retarget/test/walk.h"

namespace mimesis::retarget {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

mocap::Body scaled(mocap::Body body, double by) {
  for (auto& v : body.offset_m) v *= by;
  for (auto* pair : {&body.toe_m, &body.heel_m, &body.hand_m}) {
    for (auto& v : *pair) v *= by;
  }
  body.head_top_m *= by;
  return body;
}

/// A child: short legs, shorter arms, other feet.
mocap::Body child() {
  mocap::Body body = scaled(mocap::standard_body(), 0.62);
  body.name = "child";
  for (const int j : {mocap::kLeftKnee, mocap::kRightKnee}) {
    body.offset_m[static_cast<std::size_t>(j)] *= 0.9;
  }
  for (auto& toe : body.toe_m) toe.x() *= 0.8;
  body.offset_m[mocap::kLeftHip].y() *= 1.2;
  body.offset_m[mocap::kRightHip].y() *= 1.2;
  return body;
}

TEST(LegIk, ReachesGoalsWithTheKneeForwardAndTheFootWhereItWas) {
  const TwoSegments leg{{0.0, 0.01, -0.4}, {0.02, 0.0, -0.42}};
  const Vector3d hip(0.1, 0.2, 0.9);
  for (const double knee : {0.0, 0.02, 0.5, 1.5}) {
    const Matrix3d upper = math::exp_so3({0.1, -0.3, 0.2});
    const Matrix3d lower = upper * math::exp_so3({0.0, knee, 0.0});
    for (const Vector3d& goal :
         {Vector3d(0.2, 0.2, 0.15), Vector3d(0.3, 0.1, 0.4), Vector3d(-0.2, 0.3, 0.2)}) {
      const LimbPosture l = reach(leg, upper, lower, hip, goal);
      EXPECT_LT(l.miss_m, 1e-12);
      const Vector3d ankle = hip + l.R_upper * leg.upper_m + l.R_lower * leg.lower_m;
      EXPECT_LT((ankle - goal).norm(), 1e-12);
      const Vector3d bend = math::log_so3(l.R_upper.transpose() * l.R_lower);
      EXPECT_GT(bend.y(), 0.1);                                      // forward
      EXPECT_LT(std::hypot(bend.x(), bend.z()), 0.2 * bend.norm());  // about its own axis
    }
  }
  // frames without need of correction stay unchanged
  const Matrix3d upper = math::exp_so3({0.0, -0.4, 0.0});
  const Matrix3d lower = upper * math::exp_so3({0.0, 0.8, 0.0});
  const Vector3d goal = hip + upper * leg.upper_m + lower * leg.lower_m;
  const LimbPosture same = reach(leg, upper, lower, hip, goal);
  EXPECT_LT((same.R_upper - upper).norm() + (same.R_lower - lower).norm(), 1e-9);
  // Too far: stretched towards it, and says how much is missing
  const LimbPosture far = reach(leg, upper, lower, hip, hip + Vector3d(0.0, 0.0, -1.0));
  EXPECT_NEAR(far.miss_m, 1.0 - leg.upper_m.norm() - leg.lower_m.norm(), 1e-5);
}

TEST(ToBody, ABodyOfTheSameShapeMovesTheSame) {
  const mocap::BodyClip raw = made_up_walk();
  const BodyMotion first = retarget(raw, raw.body);
  const mocap::BodyClip& walk = first.clip;  // its feet stand still
  for (const double by : {1.0, 0.6}) {
    const BodyMotion motion = retarget(walk, scaled(walk.body, by));
    EXPECT_NEAR(motion.scale, by, 1e-12);
    // the remaining difference: feet are held back and lifted
    EXPECT_LT((motion.clip.angles_rad - walk.angles_rad).norm(),
              0.5 * (walk.angles_rad - raw.angles_rad).norm());
    EXPECT_NEAR(motion.clip.root_position_W_m(0, 150), by * walk.root_position_W_m(0, 150), 1e-12);
    // All but the legs keep their rotations
    for (int j = mocap::kSpine; j < mocap::kBodyJoints; ++j) {
      EXPECT_EQ(motion.clip.angles_rad.middleRows(3 * j, 3), walk.angles_rad.middleRows(3 * j, 3));
    }
  }
}

TEST(ToBody, FeetStandWhereTheyStoodOnAverage) {
  const mocap::BodyClip walk = made_up_walk();
  const BodyMotion motion = retarget(walk, walk.body);
  const auto was = ground_points(walk), is = ground_points(motion.clip);
  double sum = 0.0;
  long count = 0;
  for (Eigen::Index t = 0; t < walk.frames(); ++t) {
    if (!motion.contacts(kToe, t) && !motion.contacts(kHeel, t)) continue;
    sum += is(3 * kToe, t) - was(3 * kToe, t);  // left foot, along the way
    ++count;
  }
  ASSERT_GT(count, 20);
  EXPECT_LT(std::abs(sum / static_cast<double>(count)), 1e-6);
}

TEST(ToBody, FeetOfAnotherFigureStandStill) {
  const mocap::BodyClip walk = made_up_walk();
  const BodyMotion motion = retarget(walk, child());
  ASSERT_GT(motion.contacts.count(), 100);
  const double slid_m_s = motion.scale * stance_speed(walk, motion.contacts);
  EXPECT_GT(slid_m_s, 0.05);
  EXPECT_LT(stance_speed(motion.clip, motion.contacts), 0.3 * slid_m_s);
  EXPECT_LT(foot_heights(motion).standing_most, 1e-9);
  EXPECT_GT(foot_heights(motion).lowest, -1e-9);
  const double turned_rad = (motion.clip.angles_rad - walk.angles_rad).cwiseAbs().maxCoeff();
  EXPECT_GT(turned_rad, 0.0);
  EXPECT_LT(turned_rad, 0.6);
  // A point that stands alone does not move at all
  const auto points = ground_points(motion.clip);
  double worst = 0.0;
  for (Eigen::Index p = 0; p < 4; ++p) {
    for (Eigen::Index t = 0; t + 1 < points.cols(); ++t) {
      const Eigen::Index other = p ^ 1;
      if (!motion.contacts(p, t) || !motion.contacts(p, t + 1)) continue;
      if (motion.contacts(other, t) || motion.contacts(other, t + 1)) continue;
      worst =
          std::max(worst, (points.block<2, 1>(3 * p, t + 1) - points.block<2, 1>(3 * p, t)).norm());
    }
  }
  EXPECT_LT(worst, 1e-9);
  // no joint jumps: none turns faster than 12 rad/s
  const Eigen::MatrixXd& q = motion.clip.angles_rad;
  EXPECT_LT((q.rightCols(199) - q.leftCols(199)).cwiseAbs().maxCoeff() * 100.0, 12.0);
}

TEST(Ground, IsFoundBelowTheFeetWhereverItIs) {
  mocap::BodyClip walk = retarget(made_up_walk(), mocap::standard_body()).clip;  // stands on z = 0
  const Ground level = find_ground(walk);
  EXPECT_NEAR(level.height_m, 0.0, 2e-3);
  EXPECT_LT(level.slope.norm(), 5e-3);
  for (Eigen::Index t = 0; t < walk.frames(); ++t) {
    // 2 cm lower for each metre ahead, on a stage of 30 cm
    walk.root_position_W_m(2, t) += 0.3 - 0.02 * walk.root_position_W_m(0, t);
  }
  const Ground stage = find_ground(walk);
  EXPECT_NEAR(stage.slope.x(), -0.02, 4e-3);
  EXPECT_NEAR(stage.below({0.5, 0.0, 9.9}), 0.29, 5e-3);
}

TEST(ToBody, StandsOnTheGroundWhereverItWasRecorded) {
  mocap::BodyClip walk = made_up_walk();
  const BodyMotion low = retarget(walk, child());
  walk.root_position_W_m.row(2).array() += 0.3;
  const BodyMotion high = retarget(walk, child());
  EXPECT_LT((low.clip.root_position_W_m - high.clip.root_position_W_m).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((low.clip.angles_rad - high.clip.angles_rad).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(ToBody, RefusesWhatIsNoMotionOrBody) {
  const mocap::BodyClip walk = made_up_walk();
  mocap::Body legless = walk.body;
  legless.offset_m[mocap::kLeftKnee].setZero();
  EXPECT_THROW(retarget(walk, legless), ConfigError);
  mocap::BodyClip broken = walk;
  broken.angles_rad(3, 5) = std::nan("");
  EXPECT_THROW(retarget(broken, walk.body), ConfigError);
  broken = walk;
  broken.angles_rad.resize(mocap::kBodyRows, 0);
  EXPECT_THROW(retarget(broken, walk.body), ConfigError);
}

}  // namespace
}  // namespace mimesis::retarget
