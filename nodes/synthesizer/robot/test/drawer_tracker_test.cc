#include "nodes/synthesizer/robot/drawer_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/testing/no_malloc.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Vector3d;

constexpr double kDt_s = 0.005, kLeft_m = 0.14;

/// A robot that stands, its head and hands where the test puts them, and a camera with noise that
/// is 50 ms late. Images every seventh step.
class TrackerTest : public ::testing::Test {
 protected:
  TrackerTest() {
    robot_.gait = RobotGait::standing;
    robot_.hands_known = true;
    robot_.X_WH = Eigen::Isometry3d::Identity();
    robot_.X_WH->translation() = Vector3d(0.0, 0.0, 1.4);
  }
  /// Everything as it is for so many steps, with images or without.
  const DrawerSeen* run(int steps, bool sees = true) {
    for (int i = 0; i < steps; ++i) {
      DrawerSenses senses{.sight = {}, .holds = holds_};
      past_.push_back({*robot_.X_WH, handle_, object_});
      const std::size_t at = past_.size() - 1;
      if (sees && step_ % 7 == 0 && at >= kLate) {
        const Past& then = past_[at - kLate];
        const auto noisy = [&](const Vector3d& p) -> Vector3d {
          return then.X_WH.inverse() * p +
                 noise_m_ * Vector3d(n_(random_), n_(random_), n_(random_));
        };
        senses.sight = {.age_s = static_cast<double>(kLate) * kDt_s,
                        .handle_H_m = noisy(then.handle),
                        .object_H_m = noisy(then.object)};
      }
      ++step_;
      RobotFeedback said = robot_;
      const std::size_t told = at >= static_cast<std::size_t>(settings_.late_ticks)
                                   ? at - static_cast<std::size_t>(settings_.late_ticks)
                                   : 0;
      said.X_WH = past_[told].X_WH;
      seen_ = tracker_.step(&said, heading_, senses);
    }
    return seen_;
  }
  static constexpr std::size_t kLate = 10;
  struct Past {
    Eigen::Isometry3d X_WH;
    Vector3d handle, object;
  };
  TrackerSettings settings_;
  DrawerTracker tracker_{kLeft_m, kDt_s};
  RobotFeedback robot_;
  std::vector<Past> past_;
  std::array<bool, 2> holds_{};
  Vector3d handle_{0.5, 0.14, 0.92}, object_{0.7, 0.0, 0.90};
  double heading_ = 0.0, noise_m_ = 0.005;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> n_;
  const DrawerSeen* seen_ = nullptr;
  int step_ = 0;
};

/// Variance of a Kalman filter for a place that drifts by q dt between sightings with noise r:
/// p = (q + sqrt(q^2 + 4 q r)) / 2 before a sighting, and less after it.
TEST(TrackedPlace, DeviationIsThatOfTheRiccatiEquation) {
  const TrackerSettings s;
  TrackedPlace place(s, kDt_s);
  for (int i = 0; i < 7 * 3000; ++i) {
    place.step(s.walking_m);
    if (i % 7 == 0) place.see(Vector3d::Zero());
  }
  const double q = 7.0 * kDt_s * s.walking_m * s.walking_m, r = s.seen_m * s.seen_m;
  const double before = 0.5 * (q + std::sqrt(q * q + 4.0 * q * r));
  // six steps of drift after the last sighting
  const double after = before * r / (before + r) + 6.0 / 7.0 * q;
  EXPECT_NEAR(place.deviation_m(), std::sqrt(after), 0.01 * std::sqrt(after));
}

TEST_F(TrackerTest, KnowsNothingBeforeItSeesAndHoldsWhatIsHidden) {
  EXPECT_EQ(run(20, false), nullptr);
  ASSERT_NE(run(600), nullptr);
  EXPECT_LT((seen_->handle_W_m - handle_).norm(), 0.004);
  EXPECT_LT((seen_->object_W_m - object_).norm(), 0.004);
  EXPECT_LT((seen_->front_W_m - Eigen::Vector2d(0.5, 0.0)).norm(), 0.004);
  EXPECT_EQ(seen_->opened_m, 0.0);
  const Vector3d handle = seen_->handle_W_m;
  run(400, false);
  EXPECT_LT((seen_->handle_W_m - handle).norm(), 0.001);
  EXPECT_NEAR(seen_->age_s[0], 2.0, 0.05);
}

/// 300 sightings of 5 mm: the error is far below that of one, and jitters less.
TEST_F(TrackerTest, AveragesNoise) {
  run(600);
  double squares = 0.0, fastest = 0.0;
  Vector3d last = seen_->handle_W_m;
  constexpr int kSteps = 6000;
  for (int i = 0; i < kSteps; ++i) {
    run(1);
    squares += (seen_->handle_W_m - handle_).squaredNorm() / 3.0 / kSteps;
    fastest = std::max(fastest, (seen_->handle_W_m - last).norm() / kDt_s);
    last = seen_->handle_W_m;
  }
  EXPECT_LT(std::sqrt(squares), 0.0015);
  EXPECT_LT(fastest, 0.02);  // m/s: a goal that a hand can follow
}

TEST_F(TrackerTest, ImagesBelongToWhereTheHeadWas) {
  noise_m_ = 0.0;
  robot_.gait = RobotGait::walking;
  for (int i = 0; i < 400; ++i) {  // 0.3 m/s, and it nods
    robot_.X_WH->translation().x() = 0.0015 * i;
    robot_.X_WH->linear() =
        Eigen::AngleAxisd(0.1 * std::sin(0.05 * i), Vector3d::UnitY()).toRotationMatrix();
    run(1);
  }
  EXPECT_LT((seen_->handle_W_m - handle_).norm(), 1e-6);
  EXPECT_LT((seen_->object_W_m - object_).norm(), 1e-6);
}

TEST_F(TrackerTest, SingleOutliersDoNotCountAndJumpsDo) {
  run(600);
  const Vector3d handle = handle_;
  for (int i = 0; i < 20; ++i) {
    handle_ = handle + Vector3d(0.0, i % 2 == 0 ? 0.2 : -0.2, 0.0);  // never twice at one place
    run(7);
  }
  EXPECT_LT((seen_->handle_W_m - handle).norm(), 0.006);
  handle_ = handle;
  run(70);
  for (const double by_m : {0.1, -0.06}) {
    handle_.x() += by_m;
    object_.x() += by_m;
    run(static_cast<int>(kLate) + 4 * 7);
    EXPECT_LT((seen_->handle_W_m - handle_).norm(), 0.012) << by_m;
    EXPECT_LT((seen_->object_W_m - object_).norm(), 0.012) << by_m;
    run(300);
    EXPECT_LT((seen_->handle_W_m - handle_).norm(), 0.004) << by_m;
  }
}

/// A move within the gate, which noise could be, is followed within half a second.
TEST_F(TrackerTest, SmallMovesAreFollowedSoon) {
  run(2000);
  handle_.x() += 0.018;
  run(120);
  EXPECT_LT((seen_->handle_W_m - handle_).norm(), 0.007);
}

/// An estimate that was wrong is not a drawer that moved: the handle's must not take the object's
/// with it, whose correction would bring the handle's error back, and so on.
TEST_F(TrackerTest, WhatOneEstimateMissedDoesNotMoveTheOther) {
  run(600);
  handle_.x() += 0.05;
  run(100);
  for (int i = 0; i < 300; ++i) {
    run(1);
    ASSERT_LT((seen_->handle_W_m - handle_).norm(), 0.01) << i;
    ASSERT_LT((seen_->object_W_m - object_).norm(), 0.01) << i;
  }
}

TEST_F(TrackerTest, ADrawerInTheHandOpensWithIt) {
  noise_m_ = 0.0;
  run(600);
  robot_.hand_W_m = {handle_ + Vector3d(0.003, 0.002, 0.0), Vector3d::Zero()};
  holds_[0] = true;
  run(1, false);
  EXPECT_NEAR(seen_->opened_m, 0.0, 1e-12);
  robot_.hand_W_m[0] -= Vector3d(0.2, 0.01, 0.0);
  run(1, false);
  EXPECT_NEAR(seen_->opened_m, 0.2, 1e-12);
  EXPECT_LT((seen_->handle_W_m - (handle_ - Vector3d(0.2, 0.0, 0.0))).norm(), 1e-6);
  EXPECT_LT((seen_->object_W_m - (object_ - Vector3d(0.2, 0.0, 0.0))).norm(), 1e-6);
  EXPECT_LT((seen_->front_W_m - Eigen::Vector2d(0.5, 0.0)).norm(), 1e-6) << "the closed one";
  // let go, it stays open, also for the eyes
  holds_[0] = false;
  handle_.x() -= 0.2;
  object_.x() -= 0.2;
  run(100);
  EXPECT_NEAR(seen_->opened_m, 0.2, 1e-12);
  EXPECT_LT((seen_->handle_W_m - handle_).norm(), 1e-6);
  // pushed 5 cm farther it is closed, and so is what lies in it; the object was hidden
  handle_.x() += 0.2 + 0.05;
  object_.x() += 0.2 + 0.05;
  run(100);
  EXPECT_EQ(seen_->opened_m, 0.0);
  EXPECT_LT((seen_->handle_W_m - handle_).norm(), 1e-6);
  EXPECT_LT((seen_->object_W_m - object_).norm(), 1e-6);
}

/// The robot comes 0.06 rad askew: what the hand pulls 0.2 m along its way goes 12 mm aside of it.
TEST_F(TrackerTest, AnObjectThatIsPulledAskewIsSeen) {
  heading_ = 0.06;
  run(600);
  holds_[0] = true;
  robot_.hand_W_m[0] = handle_;
  run(1);
  for (int i = 0; i < 200; ++i) {
    robot_.hand_W_m[0].x() -= 0.001;
    object_.x() -= 0.001;
    run(1);
  }
  run(100);
  EXPECT_NEAR(seen_->opened_m, 0.2, 0.001);
  EXPECT_LT((seen_->object_W_m - object_).norm(), 0.005);
}

TEST_F(TrackerTest, AnObjectInTheHandIsAtTheHand) {
  run(600);
  robot_.hand_W_m[1] = {0.3, -0.2, 1.0};
  holds_[1] = true;
  run(1);
  EXPECT_TRUE(seen_->taken);
  EXPECT_EQ(seen_->object_W_m, robot_.hand_W_m[1]);
}

TEST_F(TrackerTest, WithoutARobotThereIsNoPlace) {
  run(600);
  EXPECT_EQ(tracker_.step(nullptr, 0.0, {}), nullptr);
  robot_.X_WH.reset();
  EXPECT_EQ(tracker_.step(&robot_, 0.0, {}), nullptr);
}

TEST_F(TrackerTest, DoesNotAllocate) {
  run(20);
  const DrawerSenses senses{.sight = DrawerSenses::Sight{.age_s = 0.05,
                                                         .handle_H_m = Vector3d(0.5, 0.1, -0.5),
                                                         .object_H_m = Vector3d(0.7, 0.0, -0.5)},
                            .holds = {}};
  mimesis::testing::NoMalloc guard;
  for (int i = 0; i < 100; ++i) tracker_.step(&robot_, 0.0, senses);
}

}  // namespace
}  // namespace mimesis::synthesizer
