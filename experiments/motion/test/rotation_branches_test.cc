#include "experiments/motion/rotation_branches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/math/so3.h"

namespace mimesis::synthesizer {
namespace {

/// Trials of one joint that swings around `rest` about z, and one row that is no joint.
mocap::Trials swings(const std::vector<double>& rest) {
  mocap::Trials t;
  t.rows = {"lhip.x", "lhip.y", "lhip.z", "height"};
  t.trials.resize(rest.size());
  t.samples.resize(4 * static_cast<Eigen::Index>(rest.size()), 20);
  for (std::size_t i = 0; i < rest.size(); ++i) {
    for (int s = 0; s < 20; ++s) {
      const double swing = std::sin(0.1 * std::numbers::pi * s);
      t.samples.block<4, 1>(4 * static_cast<Eigen::Index>(i), s) << 0.2 * swing, 0.1,
          rest[i] + 0.1 * swing, rest[i];
    }
  }
  return t;
}

TEST(RotationBranches, AreTheSameRotationsNextToEachOther) {
  const mocap::Trials before = swings({3.0, -3.1, 3.1, -3.0, 3.05});
  mocap::Trials after = before;
  EXPECT_EQ(align_rotation_branches(after), 2);
  for (int i = 0; i < 5; ++i) {
    EXPECT_GT(after.samples.row(4 * i + 2).mean(), 2.5) << i;
    for (int t = 0; t < 20; ++t) {
      const Eigen::Vector3d a = before.samples.block<3, 1>(4 * i, t);
      const Eigen::Vector3d b = after.samples.block<3, 1>(4 * i, t);
      EXPECT_LT((math::exp_so3(a) - math::exp_so3(b)).norm(), 1e-9);
    }
    EXPECT_EQ(after.samples.row(4 * i + 3), before.samples.row(4 * i + 3));
  }
}

TEST(RotationBranches, SmallRotationsStay) {
  mocap::Trials t = swings({0.0, 0.4, -0.5, 1.2});
  const Eigen::MatrixXd before = t.samples;
  EXPECT_EQ(align_rotation_branches(t), 0);
  EXPECT_EQ(t.samples, before);
}

}  // namespace
}  // namespace mimesis::synthesizer
