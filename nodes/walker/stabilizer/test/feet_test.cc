#include "nodes/walker/stabilizer/feet.h"

#include <gtest/gtest.h>

#include <deque>

#include "common/math/so3.h"
#include "nodes/walker/stabilizer/test/test_biped.h"

namespace mimesis::walker {
namespace {

using Points = std::vector<Eigen::Vector2d>;

TEST(Polygon, HullOfTwoSquaresLeavesOutWhatIsInside) {
  const Points points{{0, 0}, {1, 0}, {1, 1}, {0, 1}, {3, 0}, {4, 0}, {4, 1}, {3, 1}};
  const Polygon hull(points);
  ASSERT_EQ(hull.corners().size(), 4u);
  double area = 0.0;  // shoelace, positive counter-clockwise
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d a = hull.corners()[i], b = hull.corners()[(i + 1) % 4];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  EXPECT_NEAR(area, 4.0, 1e-12);
  EXPECT_TRUE(hull.contains({2.0, 0.5}));
  EXPECT_FALSE(hull.contains({2.0, 1.01}));
}

TEST(Polygon, NearestPointIsInsideItselfOnAnEdgeOrACorner) {
  const Polygon square(Points{{1, 1}, {0, 0}, {0, 1}, {1, 0}});
  EXPECT_EQ(square.nearest({0.3, 0.4}), Eigen::Vector2d(0.3, 0.4));
  EXPECT_LT((square.nearest({0.3, 2.0}) - Eigen::Vector2d(0.3, 1.0)).norm(), 1e-12);
  EXPECT_EQ(square.nearest({-2.0, -1.0}), Eigen::Vector2d(0.0, 0.0));
}

TEST(Polygon, OnePointAndALine) {
  EXPECT_EQ(Polygon(Points{{1, 2}}).nearest({5, 5}), Eigen::Vector2d(1, 2));
  EXPECT_EQ(Polygon(Points{{0, 0}, {1, 0}, {2, 0}}).nearest({1.5, 5}), Eigen::Vector2d(1.5, 0));
}

}  // namespace

namespace {

struct GroundTest : ::testing::Test {
  robot::Biped biped = test_biped();
  Ground ground{biped, 0.01};
  PatternSample plan = standing();
};

TEST_F(GroundTest, ZmpStaysInTheHullOfBothFeetOrOnTheFootThatCarries) {
  EXPECT_EQ(ground.reachable(plan, {0.05, 0.0}), Eigen::Vector2d(0.05, 0.0));
  EXPECT_LT((ground.reachable(plan, {0.5, 0.0}) - Eigen::Vector2d(0.12, 0.0)).norm(), 1e-12);
  EXPECT_LT((ground.reachable(plan, {0.0, 0.5}) - Eigen::Vector2d(0.0, 0.16)).norm(), 1e-12);
  plan.contact[kLeft] = false;  // inner edge of the right foot
  EXPECT_LT((ground.reachable(plan, {0.0, 0.0}) - Eigen::Vector2d(0.0, -0.049)).norm(), 1e-12);
  plan.contact[kRight] = false;
  EXPECT_EQ(ground.reachable(plan, {0.5, 0.0}), Eigen::Vector2d(0.5, 0.0));
}

TEST_F(GroundTest, ReachFollowsTheHeadingOfTheFoot) {
  plan.contact[kLeft] = false;
  plan.foot[kRight].X_WS.linear() =
      Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_LT((ground.reachable(plan, {0.0, 9.0}) - Eigen::Vector2d(0.0, -0.095 + 0.12)).norm(),
            1e-12);
}

TEST_F(GroundTest, WeightIsSplitByTheLeverBetweenTheAnkles) {
  const auto shares = ground.distribute(plan, {0.03, 0.0475});
  EXPECT_NEAR(shares.left, 0.75, 1e-12);
  for (Side s : robot::kSides) {
    EXPECT_LT((shares.cop_S_m[s] - Eigen::Vector2d(0.03, 0.0)).norm(), 1e-12);
  }
  const auto outside = ground.distribute(plan, {-0.2, 0.12});  // beyond the left ankle
  EXPECT_EQ(outside.left, 1.0);
  EXPECT_LT((outside.cop_S_m[kLeft] - Eigen::Vector2d(-0.09, 0.025)).norm(), 1e-12);
  plan.contact[kLeft] = false;
  const auto single = ground.distribute(plan, {0.02, -0.1});
  EXPECT_EQ(single.left, 0.0);
  EXPECT_LT((single.cop_S_m[kRight] - Eigen::Vector2d(0.02, -0.005)).norm(), 1e-12);
}

TEST_F(GroundTest, CentreOfPressureIsInTheHeadingOfTheFoot) {
  plan.contact[kLeft] = false;
  plan.foot[kRight].X_WS.linear() =
      Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto shares = ground.distribute(plan, {0.03, -0.095 + 0.02});
  EXPECT_LT((shares.cop_S_m[kRight] - Eigen::Vector2d(0.02, -0.03)).norm(), 1e-12);
}

TEST_F(GroundTest, ZmpOfWrenchesIsWhereTheyBalance) {
  std::array<robot::Wrench, 2> wrench;
  wrench[kLeft].force.z() = 100.0;
  wrench[kLeft].moment = Eigen::Vector3d(2.0, -3.0, 0.0);  // at (0.03, 0.02) in S
  wrench[kRight].force.z() = 300.0;
  const auto zmp = measured_zmp(plan, wrench, 100.0);
  ASSERT_TRUE(zmp.has_value());
  EXPECT_NEAR(zmp->x(), 0.25 * 0.03, 1e-12);
  EXPECT_NEAR(zmp->y(), 0.25 * (0.095 + 0.02) - 0.75 * 0.095, 1e-12);
  EXPECT_FALSE(measured_zmp(plan, wrench, 401.0).has_value());
}

}  // namespace

namespace {

struct FeetTest : ::testing::Test {
  Eigen::Vector3d tilt(Side s) const { return math::log_so3(Eigen::Matrix3d(X_WS[s].linear())); }
  double height(Side s) const { return X_WS[s].translation().z(); }
  void single_support_on_right(double to_landing_s) {
    plan.contact[kLeft] = false;
    plan.to_landing_s = to_landing_s;
    wished.left = 0.0;
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) X_WS = feet.step(plan, wished, measured);
  }
  robot::Biped biped = test_biped();
  StabilizerSettings settings;
  Feet feet{biped, settings};
  PatternSample plan = standing();
  Ground::Shares wished{.left = 0.5, .cop_S_m = {Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 0)}};
  Feet::Measured measured{{}, Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()};
  std::array<Eigen::Isometry3d, 2> X_WS;
};

/// A sole on a soft ground: toes down (θ_y > 0) give M_y < 0, left edge up (θ_x > 0) gives M_x < 0.
TEST_F(FeetTest, PressureComesToTheWishedPoint) {
  constexpr double kStiffness = 400.0, kNormal = 300.0;
  wished.cop_S_m.fill({0.05, -0.02});
  for (int i = 0; i < 2000; ++i) {
    run(1);
    for (Side s : robot::kSides) {
      measured.foot_S[s].force.z() = kNormal;
      measured.foot_S[s].moment.head<2>() = -kStiffness * tilt(s).head<2>();
    }
  }
  // the leak leaves A (K θ − M_d) = θ/T
  const double gain = settings.cop_rad_s_n_m * settings.cop_leak_s;
  const double share = gain * kStiffness / (1.0 + gain * kStiffness);
  for (Side s : robot::kSides) {
    const auto& m = measured.foot_S[s].moment;
    EXPECT_NEAR(-m.y() / kNormal, share * wished.cop_S_m[s].x(), 1e-4);
    EXPECT_NEAR(m.x() / kNormal, share * wished.cop_S_m[s].y(), 1e-4);
  }
}

TEST_F(FeetTest, InDoubleSupportASoleTurnsLittleOnItsOwn) {
  measured.foot_S[kLeft] = {{0.0, 0.0, 300.0}, {0.0, 10.0, 0.0}};
  run(1);
  const double own = kTick_s * settings.cop_rad_s_n_m * 10.0;
  EXPECT_NEAR(tilt(kRight).y(), own * 0.5 * (1.0 - settings.cop_alone), 1e-9);
  EXPECT_NEAR(tilt(kLeft).y(), own * 0.5 * (1.0 + settings.cop_alone), 1e-9);
}

TEST_F(FeetTest, TheMeanOfTheSolesIsByLoad) {
  wished.left = 0.8;
  measured.foot_S[kLeft] = {{0.0, 0.0, 480.0}, {0.0, 10.0, 0.0}};
  run(1);
  const double own = kTick_s * settings.cop_rad_s_n_m * 10.0;
  EXPECT_NEAR(tilt(kRight).y(), own * 0.8 * (1.0 - settings.cop_alone), 1e-9);
}

TEST_F(FeetTest, SoleTurnsAboutItsPivotInItsOwnHeading) {
  biped.leg[kLeft].ankle_S_m = {0.01, 0.0, 0.105};
  plan.foot[kLeft].X_WS.linear() = math::exp_so3({0.0, 0.0, M_PI / 2.0});
  measured.foot_S[kLeft] = {{0.0, 0.0, 300.0}, {0.0, 10.0, 0.0}};
  run(20);
  const Eigen::Vector3d ankle_S = settings.cop_pivot * biped.leg[kLeft].ankle_S_m;
  EXPECT_LT((X_WS[kLeft] * ankle_S - plan.foot[kLeft].X_WS * ankle_S).norm(), 1e-12);
  const Eigen::Matrix3d R_S = plan.foot[kLeft].X_WS.linear().transpose() * X_WS[kLeft].linear();
  EXPECT_GT(math::log_so3(R_S).y(), 0.005);
  EXPECT_NEAR(math::log_so3(R_S).x(), 0.0, 1e-12);
}

TEST_F(FeetTest, FootThatCarriesTooMuchGoesUpAndTheOtherDown) {
  single_support_on_right(0.5);
  run(1);
  plan.contact[kLeft] = true;
  wished.left = 0.5;
  measured.foot_S[kLeft].force.z() = 400.0;
  measured.foot_S[kRight].force.z() = 200.0;
  run(1);
  EXPECT_NEAR(height(kLeft), 0.5 * kTick_s * settings.force_m_s_n * 200.0, 1e-12);
  EXPECT_NEAR(height(kLeft), -height(kRight), 1e-12);
  // carried as wished: nothing but the leak
  const double before = height(kLeft), weight = biped.tree.mass_kg() * robot::kGravity;
  wished.left = 0.8;
  measured.foot_S[kLeft].force.z() = 0.8 * weight;
  measured.foot_S[kRight].force.z() = 0.2 * weight;
  run(10);
  EXPECT_NEAR(height(kLeft), before * std::pow(1.0 - kTick_s / settings.force_leak_s, 10), 1e-9);
}

TEST_F(FeetTest, HeightsThatTheLandingFoundAreHeldWhileTheRobotStands) {
  measured.foot_S[kLeft].force.z() = 400.0;
  run(10);
  EXPECT_EQ(height(kLeft), 0.0) << "it starts on ground that is known";
  single_support_on_right(0.5);
  run(1);
  plan.contact[kLeft] = true;
  wished.left = 0.5;
  const int window = static_cast<int>(std::lround(settings.force_window_s / kTick_s));
  run(window);
  const double found = height(kLeft);
  EXPECT_GT(found, 1e-3);
  run(1000);
  EXPECT_NEAR(height(kLeft), found, 2e-4);
}

TEST_F(FeetTest, FootThatIsDueAndNotFeltGoesOnDownUntilItIs) {
  settings.force_m_s_n = 0.0;
  const double weight = biped.tree.mass_kg() * robot::kGravity;
  single_support_on_right(0.01);
  plan.foot[kLeft].v_W.z() = -settings.reach_m_s;
  measured.foot_S[kRight].force.z() = weight;
  run(2);
  EXPECT_EQ(height(kLeft), 0.0) << "not while the plan goes down";
  plan.foot[kLeft].v_W.z() = 0.0;
  plan.contact[kLeft] = true;
  run(4);
  EXPECT_NEAR(height(kLeft), -4 * kTick_s * settings.reach_m_s, 2e-5);
  EXPECT_EQ(height(kRight), 0.0) << "it has carried all along";
  run(200);
  EXPECT_NEAR(height(kLeft), -settings.reach_limit_m, 1e-9);
  measured.foot_S[kLeft].force.z() = 0.1 * weight;
  run(1);
  const double found = height(kLeft);
  measured.foot_S[kLeft].force.z() = 0.0;  // felt once: its load now is not the ground's reaction
  run(10);
  EXPECT_NEAR(height(kLeft), found * std::pow(1.0 - kTick_s / settings.force_leak_s, 10), 1e-9);
  single_support_on_right(0.5);
  run(200);
  EXPECT_NEAR(height(kLeft), 0.0, 5e-4) << "the next swing is as planned";
}

TEST_F(FeetTest, WhatWasNotFeltBlindIsNotReachedForAfterwards) {
  single_support_on_right(0.01);
  run(1);
  plan.contact[kLeft] = true;
  wished.left = 0.0;
  measured.foot_S[kRight].force.z() = biped.tree.mass_kg() * robot::kGravity;
  X_WS = feet.fade(plan);
  const double before = height(kLeft);
  run(1);
  EXPECT_GT(height(kLeft), before - 1e-5);
}

TEST_F(FeetTest, LegsKeepTheirLengthsForAFootThatIsNotFelt) {
  settings.reach_m_s = 0.0;
  const double weight = biped.tree.mass_kg() * robot::kGravity;
  measured.give_m_n = 3e-6;
  single_support_on_right(0.01);
  measured.foot_S[kRight].force.z() = weight;
  run(1);
  const double stance = height(kRight), swing = height(kLeft);
  EXPECT_NEAR(stance, -3e-6 * 0.5 * weight, 1e-9);
  plan.contact[kLeft] = true;
  wished.left = 0.6;
  run(5);
  EXPECT_NEAR(height(kRight), stance, 1e-9);
  EXPECT_NEAR(height(kLeft), swing, 1e-9);
  measured.foot_S[kLeft].force.z() = 0.6 * weight;
  measured.foot_S[kRight].force.z() = 0.4 * weight;  // force as wished: only the give moves
  run(1);
  EXPECT_NEAR(height(kRight), stance + 0.05 * 3e-6 * weight, 1e-9) << "and then not at once";
  run(20);
  EXPECT_NEAR(height(kRight), 3e-6 * (0.5 - 0.4) * weight, 1e-9);
}

TEST_F(FeetTest, WeightThatRocksFromFootToFootIsLetBe) {
  const auto sway = [&](int k) {
    measured.foot_S[kLeft].force.z() = k / 4 % 2 == 0 ? 500.0 : 100.0;
    measured.foot_S[kRight].force.z() = 600.0 - measured.foot_S[kLeft].force.z();
    run(1);
  };
  for (int k = 0; k < 200; ++k) sway(k);
  double low = 1.0, high = -1.0;
  for (int k = 0; k < 40; ++k) {
    sway(k);
    low = std::min(low, height(kLeft));
    high = std::max(high, height(kLeft));
  }
  EXPECT_LT(high - low, 0.2 * 4 * kTick_s * settings.force_m_s_n * 400.0 / 2);
}

TEST_F(FeetTest, EarlyLandingGivesWayToItsForceShortlyBeforeItIsDue) {
  const double weight = biped.tree.mass_kg() * robot::kGravity, least = 0.05 * weight;
  plan.foot[kLeft].X_WS.translation().z() = 0.004;
  measured.foot_S[kLeft].force.z() = least + 100.0;
  single_support_on_right(0.4);
  run(10);
  EXPECT_EQ(height(kLeft), 0.004);
  plan.to_landing_s = 0.2;
  run(10);
  EXPECT_NEAR(height(kLeft), 0.004 + 10 * kTick_s * settings.landing_m_s_n * 100.0, 1e-9);
  EXPECT_EQ(height(kRight), 0.0);
  measured.foot_S[kLeft].force.z() = least;
  const double found = height(kLeft);
  run(10);
  EXPECT_NEAR(height(kLeft), found, 1e-12) << "it stays in touch, and presses no more than that";
  measured.foot_S[kLeft].force.z() = 5.0 * weight;
  run(1);
  EXPECT_NEAR(height(kLeft), found + kTick_s * 4.0 * settings.reach_m_s, 1e-9)
      << "it does not jump away from an impact";
  run(2000);
  EXPECT_NEAR(height(kLeft), 0.004 + settings.landing_limit_m, 1e-9);
}

TEST_F(FeetTest, FootThatTouchesEarlyGoesDownNoMore) {
  const double weight = biped.tree.mass_kg() * robot::kGravity;
  FootState& planned = plan.foot[kLeft];
  planned.v_W.z() = -settings.reach_m_s;
  single_support_on_right(0.1);
  const auto glide = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) {
      planned.X_WS.translation().z() += kTick_s * planned.v_W.z();
      run(1);
    }
  };
  planned.X_WS.translation().z() = 0.005 + 5 * kTick_s * settings.reach_m_s;
  glide(5);
  EXPECT_NEAR(height(kLeft), 0.005, 1e-12) << "not felt: as planned";
  measured.foot_S[kLeft].force.z() = 0.05 * weight + 1e-6;
  glide(10);
  EXPECT_NEAR(height(kLeft), 0.005, 1e-9);
  measured.foot_S[kLeft].force.z() = 0.0;  // it has touched; a short bounce is no lower ground
  glide(10);
  EXPECT_NEAR(height(kLeft), 0.005 - 10 * kTick_s * settings.landing_m_s_n * 0.05 * weight, 1e-9);
  // it stands on the found ground, which is forgotten over a step
  const double found = height(kLeft) - planned.X_WS.translation().z();
  plan.contact[kLeft] = true;
  wished.left = 0.0;
  planned.X_WS.translation().z() = planned.v_W.z() = 0.0;
  measured.foot_S[kLeft].force.z() = 0.1 * weight;
  measured.foot_S[kRight].force.z() = 1.1 * weight;  // force as wished: the difference does not act
  plan.foot[kLeft].v_W.setZero();
  EXPECT_GT(found, 0.002);
  run(20);
  EXPECT_NEAR(height(kLeft), found * std::exp(-20 * kTick_s / settings.landing_leak_s), 2e-5);
}

/// A leg of 3e5 N/m whose force is known 20 ms after the command: the gain that this allows.
TEST_F(FeetTest, FootOnStiffGroundComesToRestInTouch) {
  constexpr double kLeg_n_m = 3e5, kGround_m = 0.003;
  constexpr int kLate = 4;
  const double least = 0.05 * biped.tree.mass_kg() * robot::kGravity;
  single_support_on_right(0.15);
  FootState& planned = plan.foot[kLeft];
  planned.v_W.z() = -settings.reach_m_s;
  planned.X_WS.translation().z() = 0.0045;
  std::deque<double> late(kLate, planned.X_WS.translation().z());
  double highest = 0.0;
  bool touched = false;
  for (int i = 0; i < 80; ++i) {
    const double force_n = kLeg_n_m * std::max(0.0, kGround_m - late.front());
    touched = touched || force_n > least;
    measured.foot_S[kLeft].force.z() = force_n;
    planned.X_WS.translation().z() += kTick_s * planned.v_W.z();
    run(1);
    late.pop_front();
    late.push_back(height(kLeft));
    if (touched) highest = std::max(highest, height(kLeft) - kGround_m);
    if (i > 50) {
      EXPECT_NEAR(force_n, least, 0.5 * least) << i;
    }
  }
  EXPECT_LT(highest, 0.5e-3);
}

TEST_F(FeetTest, FootThatIsDownBeforeItIsDueReachesUntilItTouches) {
  const double weight = biped.tree.mass_kg() * robot::kGravity;
  single_support_on_right(0.04);
  plan.foot[kLeft].v_W.z() = -0.6 * settings.reach_m_s;
  run(4);
  EXPECT_NEAR(height(kLeft), -4 * kTick_s * 0.4 * settings.reach_m_s, 1e-5) << "what is missing";
  plan.foot[kLeft].v_W.z() = 0.0;
  const double brake = height(kLeft);
  run(4);
  EXPECT_NEAR(height(kLeft), brake - 4 * kTick_s * settings.reach_m_s, 3e-5);
  const double found = height(kLeft);
  measured.foot_S[kLeft].force.z() = 0.05 * weight + 1e-6;
  run(4);
  EXPECT_NEAR(height(kLeft), found, 3e-5);
  // at the lift-off it is on the ground by the plan too
  measured.foot_S[kLeft].force.z() = 0.0;
  plan.to_landing_s = 0.7;
  run(1);
  EXPECT_GT(height(kLeft), found);
}

TEST_F(FeetTest, EverySwingTouchesAnew) {
  const double weight = biped.tree.mass_kg() * robot::kGravity;
  single_support_on_right(0.1);
  measured.foot_S[kLeft].force.z() = 0.2 * weight;
  run(1);
  plan.to_landing_s = 0.6;
  measured.foot_S[kLeft].force.z() = 0.0;
  run(1);
  plan.to_landing_s = 0.1;
  plan.foot[kLeft].v_W.z() = -0.04;
  const double before = height(kLeft);
  run(10);
  EXPECT_LT(height(kLeft), before);
}

TEST_F(FeetTest, AForceThatPullsOnALandingFootIsAnErrorOfTheSensor) {
  const double least = 0.05 * biped.tree.mass_kg() * robot::kGravity;
  single_support_on_right(0.2);
  plan.foot[kLeft].X_WS.translation().z() = 0.004;
  measured.foot_S[kLeft].force.z() = 200.0;
  run(20);
  const double before = height(kLeft);
  ASSERT_GT(before, 0.004);
  measured.foot_S[kLeft].force.z() = -200.0;
  run(10);
  EXPECT_NEAR(height(kLeft), before - 10 * kTick_s * settings.landing_m_s_n * least, 1e-9);
}

TEST_F(FeetTest, SwingFootIsWhereItIsPlannedThoughTheBaseIsNot) {
  single_support_on_right(0.4);
  plan.foot[kLeft].X_WS.translation() = Eigen::Vector3d(0.2, 0.1, 0.04);
  measured.X_WB_planned.translation() = Eigen::Vector3d(0.05, 0.0, 0.65);
  measured.X_WB = measured.X_WB_planned;
  measured.X_WB.linear() = math::exp_so3({0.01, 0.02, 0.005});
  measured.X_WB.translation() += Eigen::Vector3d(0.004, -0.003, 0.0);
  run(200);
  const Eigen::Isometry3d X_BS = measured.X_WB_planned.inverse() * X_WS[kLeft];
  const Eigen::Isometry3d truth = measured.X_WB * X_BS;  // motion of the leg on the true base
  const Eigen::Isometry3d& wish = plan.foot[kLeft].X_WS;
  EXPECT_LT((truth.translation() - wish.translation()).norm(), 1e-4);
  EXPECT_LT(math::log_so3(Eigen::Matrix3d(truth.linear() * wish.linear().transpose())).norm(),
            1e-4);
  EXPECT_TRUE(X_WS[kRight].isApprox(plan.foot[kRight].X_WS));

  measured.X_WB.translation().z() += 0.05;  // more than a plate can be: the height is limited
  run(200);
  EXPECT_NEAR(height(kLeft) - wish.translation().z(), -settings.swing_height_limit_m, 1e-6);

  EXPECT_FALSE(feet.touched(kLeft));
  plan.to_landing_s = 0.2;
  measured.foot_S[kLeft].force.z() = 100.0;
  run(1);
  EXPECT_TRUE(feet.touched(kLeft));
  const Eigen::Vector2d on_ground = X_WS[kLeft].translation().head<2>();
  measured.X_WB.translation().head<2>() += Eigen::Vector2d(0.02, 0.02);
  run(40);
  EXPECT_LT((X_WS[kLeft].translation().head<2>() - on_ground).norm(), 1e-9) << "it bears";
}

TEST_F(FeetTest, LoadedLegIsLongerByItsGiveAndTheUnloadedOneShorter) {
  measured.give_m_n = 3e-6;
  const double weight = biped.tree.mass_kg() * robot::kGravity;
  wished.left = 0.8;
  measured.foot_S[kLeft].force.z() = 0.8 * weight;
  measured.foot_S[kRight].force.z() = 0.2 * weight;
  run(1);
  EXPECT_NEAR(height(kLeft), -3e-6 * 0.3 * weight, 1e-12);
  EXPECT_NEAR(height(kRight), 3e-6 * 0.3 * weight, 1e-12);
  single_support_on_right(0.5);
  run(1);
  EXPECT_NEAR(height(kLeft), 3e-6 * 0.5 * weight, 1e-12);
  EXPECT_NEAR(height(kRight), -3e-6 * 0.5 * weight, 1e-12);
  feet.fade(plan);
  EXPECT_NEAR(feet.fade(plan)[kRight].translation().z(), -3e-6 * 0.5 * weight, 1e-12);
  plan.contact = {true, false};  // without measurements the weight is where it is planned
  EXPECT_NEAR(feet.fade(plan)[kLeft].translation().z(), -3e-6 * 0.5 * weight, 1e-12);
}

TEST_F(FeetTest, CorrectionsFadeWithoutMeasurements) {
  wished.cop_S_m.fill({0.05, 0.02});
  measured.foot_S[kLeft] = {{0.0, 0.0, 400.0}, {5.0, 5.0, 0.0}};
  run(50);
  ASSERT_FALSE(X_WS[kLeft].isApprox(plan.foot[kLeft].X_WS, 1e-3));
  for (int i = 0; i < 4000; ++i) X_WS = feet.fade(plan);
  for (Side s : robot::kSides) EXPECT_TRUE(X_WS[s].isApprox(plan.foot[s].X_WS, 1e-6));
}

}  // namespace

}  // namespace mimesis::walker
