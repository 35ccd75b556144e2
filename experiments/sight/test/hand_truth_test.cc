#include <gtest/gtest.h>

#include <cmath>

#include "experiments/sight/truth/hand_world.h"

namespace mimesis::truth {
namespace {

TEST(HandWorld, IsAFunctionOfSeedAndFrame) {
  HandWorldSetup setup;
  HandWorld a(setup), b(setup);
  image::Image first, second, other;
  a.render(5, 0, first);
  b.render(40, 0, second);
  b.render(5, 0, second);
  EXPECT_EQ(first.bgr, second.bgr);
  setup.seed = 2;
  HandWorld c(setup);
  c.render(5, 0, other);
  EXPECT_NE(first.bgr, other.bgr);
}

TEST(HandWorld, StandsWhereTheCameraOfItsViewSeesIt) {
  // The palm hides what is behind it, in both pictures at the pixel of the calibrated camera.
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    HandWorldSetup with;
    with.seed = seed;
    with.cameras = 2;
    with.noise = 0.0;
    HandWorld world(with);
    const HandTruth hand = world.truth(0);
    for (int k = 0; k < 2; ++k) {
      const image::Camera camera(world.view(k));
      image::Image here, later;
      world.render(0, k, here);
      const Eigen::Vector2d palm = camera.project(hand.palm_T);
      const std::uint8_t* p =
          here.at(static_cast<int>(std::lround(palm.x())), static_cast<int>(std::lround(palm.y())));
      EXPECT_GT(p[2], p[1]) << "seed " << seed << ", camera " << k;
      EXPECT_GT(p[1], p[0]) << "seed " << seed << ", camera " << k;
    }
  }
}

TEST(HandWorld, DrawsPeopleAndMovesAllJoints) {
  int left = 0;
  double shortest = 1.0, longest = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    HandWorldSetup setup;
    setup.seed = seed;
    const HandWorld world(setup);
    left += world.anatomy().left ? 1 : 0;
    shortest = std::min(shortest, world.anatomy().length_m);
    longest = std::max(longest, world.anatomy().length_m);
    const HandTruth a = world.truth(0), b = world.truth(10);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        EXPECT_NE(a.gesture.fingers[i][j], b.gesture.fingers[i][j]);
      }
    }
    EXPECT_LT((world.truth(1).palm_T - a.palm_T).norm(), 0.02);  // smoothly
    // The thumb is on the side that the convention of frame H says: +y for a left hand.
    const Eigen::Vector3d thumb = a.R_TH.transpose() * (a.tips_T[0] - a.palm_T);
    const Eigen::Vector3d little = a.R_TH.transpose() * (a.tips_T[4] - a.palm_T);
    EXPECT_EQ(thumb.y() > little.y(), world.anatomy().left) << seed;
  }
  EXPECT_GT(left, 4);
  EXPECT_LT(left, 16);
  EXPECT_GT(longest / shortest, 1.1);
}

}  // namespace
}  // namespace mimesis::truth
