#include <gtest/gtest.h>

#include "common/error.h"
#include "common/math/so3.h"
#include "common/testing/no_malloc.h"
#include "nodes/vision/hand/testing/drawn_hand.h"

namespace mimesis::vision {
namespace {

using Eigen::Vector3d;

const image::View kFirst{{0.1, 0.3, 0.7}, {0.1, 0.25, 0.0}, 560.0, 640, 480};
const image::View kSecond{{0.24, 0.3, 0.7}, {0.14, 0.25, 0.0}, 580.0, 640, 480};

/// A slowly moving hand of the tracker's own shape.
HandPose moving(int frame) {
  HandPose pose;
  const double s = 0.02 * frame;
  pose.p_CH = {0.02 + 0.1 * s, -0.01, 0.6 + 0.05 * s};
  Eigen::Matrix3d base;  // fingers to the right, palm to the camera
  base << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  pose.R_CH = math::exp_so3(Vector3d(0.1, 0.3 * s, 0.5 * s)) * base;
  for (std::size_t j = 0; j < kHandJoints; ++j) {
    pose.joint_rad[j] =
        hand_joint_ranges()[j].rest * (1.0 + 0.4 * std::sin(s + static_cast<double>(j)));
  }
  return pose;
}

struct Outcome {
  double across_m, along_m, turn_rad, length_m;
  HandEstimate last;
};

Outcome run(int eyes, std::uint64_t seed, double told_m, int frames, const HandShape& shape = {}) {
  const auto moving = [&shape](int f) {
    HandPose pose = vision::moving(f);
    pose.shape = shape;
    return pose;
  };
  DrawnHand first(kFirst), second(kSecond);
  const HandModel model(0.18);
  std::vector<image::Camera> cameras{first.camera};
  if (eyes == 2) cameras.push_back(second.camera);
  HandTracker tracker({.length_m = told_m, .seed = seed}, cameras);
  HandPose guess = vision::moving(0);  // of the published shape
  guess.p_CH += Vector3d(0.012, -0.01, 0.015);
  guess.R_CH = guess.R_CH * math::exp_so3(Vector3d(0.15, 0.0, -0.2));
  tracker.start(guess);
  for (int f = 0; f < frames; ++f) {
    const image::Image a = first.draw(model, moving(f), first.camera);
    const image::Image b = second.draw(model, moving(f), first.camera);
    const std::array<const image::Image*, 2> images{&a, &b};
    const testing::NoMalloc guard;
    tracker.step(std::span(images).first(static_cast<std::size_t>(eyes)));
  }
  const HandPose truth = moving(frames - 1);
  const HandEstimate& e = tracker.estimate();
  const Vector3d error = e.pose.p_CH - truth.p_CH;
  return {error.head<2>().norm(), std::abs(error.z()),
          math::log_so3(Eigen::Matrix3d(truth.R_CH.transpose() * e.pose.R_CH)).norm(),
          tracker.length_m(), e};
}

TEST(HandTracker, FollowsItsOwnModel) {
  constexpr int kRuns = 2;
  std::array<Outcome, 2> mean{};
  for (int seed = 1; seed <= kRuns; ++seed) {
    for (const int eyes : {1, 2}) {
      const Outcome o = run(eyes, static_cast<std::uint64_t>(seed), 0.18, 12);
      EXPECT_TRUE(o.last.found) << seed;
      Outcome& m = mean.at(static_cast<std::size_t>(eyes - 1));
      m.across_m += o.across_m / kRuns;
      m.along_m += o.along_m / kRuns;
      m.turn_rad += o.turn_rad / kRuns;
    }
  }
  EXPECT_LT(mean[0].across_m, 0.004);
  EXPECT_LT(mean[0].along_m, 0.02);
  EXPECT_LT(mean[0].turn_rad, 0.2);
  EXPECT_LT(mean[1].across_m, 0.004);
  EXPECT_LT(mean[1].along_m, 0.005);
  EXPECT_LT(mean[1].turn_rad, 0.2);
}

TEST(HandTracker, TwoCamerasCorrectTheLength) {
  const Outcome stereo = run(2, 1, 0.18 * 1.08, 30);
  EXPECT_LT(std::abs(stereo.length_m / 0.18 - 1.0), 0.07);
  EXPECT_EQ(run(1, 1, 0.18 * 1.08, 3).length_m, 0.18 * 1.08);  // one cannot
}

TEST(HandTracker, LearnsAPersonsPalmAndBreadth) {
  for (const double sign : {-1.0, 1.0}) {
    const HandShape shape{0.1 * sign, -0.08 * sign, 0.0};
    const Outcome stereo = run(2, 1, 0.18, 30, shape);
    const HandShape& learned = stereo.last.pose.shape;
    EXPECT_NEAR(learned.palm / shape.palm, 0.6, 0.3);  // not all: what is published counts, too
    EXPECT_NEAR(learned.breadth / shape.breadth, 0.8, 0.4);
    EXPECT_LT(stereo.across_m, 0.004);
    EXPECT_LT(stereo.along_m, 0.005);
  }
}

TEST(HandTracker, AsksForAHandFollowedWellBeforeItLearnsItsShape) {
  const HandShape shape{0.1, -0.08, 0.0};
  const HandShape& early = run(2, 1, 0.18, 5, shape).last.pose.shape;
  EXPECT_EQ(early.palm, 0.0);
  EXPECT_EQ(early.breadth, 0.0);
  const HandShape& next = run(2, 1, 0.18, 7, shape).last.pose.shape;
  EXPECT_NE(next.palm, 0.0);
}

TEST(HandTracker, SameInputsSameBits) {
  const Outcome a = run(1, 5, 0.18, 3), b = run(1, 5, 0.18, 3);
  EXPECT_EQ(a.last.pose.p_CH, b.last.pose.p_CH);
  EXPECT_EQ(a.last.pose.R_CH, b.last.pose.R_CH);
  EXPECT_EQ(a.last.pose.joint_rad, b.last.pose.joint_rad);
  EXPECT_EQ(a.last.score, b.last.score);
  EXPECT_NE(a.last.score, run(1, 6, 0.18, 3).last.score);
}

TEST(HandTracker, SaysThatTheHandIsGoneAndKeepsItsPose) {
  DrawnHand drawn(kFirst);
  const HandModel model(0.18);
  HandTracker tracker({.length_m = 0.18}, std::span(&drawn.camera, 1));
  tracker.start(moving(0));
  const image::Image hand = drawn.draw(model, moving(0), drawn.camera);
  image::Image empty(640, 480);
  std::fill(empty.bgr.begin(), empty.bgr.end(), std::uint8_t{128});
  const auto step = [&](const image::Image& i) {
    const std::array<const image::Image*, 1> one{&i};
    return tracker.step(one).found;
  };
  EXPECT_TRUE(step(hand));
  EXPECT_TRUE(step(hand));
  const Vector3d before = tracker.estimate().pose.p_CH;
  for (int k = 0; k < 4; ++k) EXPECT_FALSE(step(empty));
  EXPECT_LT((tracker.estimate().pose.p_CH - before).norm(), 1e-12);
  EXPECT_TRUE(step(hand));
}

TEST(HandTracker, SpeaksOfPosesInTheFrameOfTheCalibration) {
  const image::Camera camera(kFirst);
  HandTracker tracker({}, std::span(&camera, 1));
  const Vector3d p(0.12, 0.2, 0.03);
  const Eigen::Matrix3d R = math::exp_so3(Vector3d(0.3, 0.2, -1.0));
  tracker.start(tracker.from_T(p, R, true));
  EXPECT_LT((tracker.p_TH() - p).norm(), 1e-12);
  EXPECT_LT((tracker.R_TH() - R).norm(), 1e-12);
}

TEST(HandTracker, RefusesThreeCamerasAndPicturesOfTwoSizes) {
  const image::Camera a(kFirst);
  image::View small = kSecond;
  small.width_px = 320;
  small.height_px = 240;
  const std::vector<image::Camera> three{a, a, a}, mixed{a, image::Camera(small)};
  EXPECT_THROW(HandTracker({}, three), ConfigError);
  EXPECT_THROW(HandTracker({}, mixed), ConfigError);
  EXPECT_THROW(HandTracker({}, {}), ConfigError);
}

}  // namespace
}  // namespace mimesis::vision
