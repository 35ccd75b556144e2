#include <gtest/gtest.h>

#include "hw/sim/world/world.h"

namespace mimesis::world {
namespace {

const HandShape kHand;
constexpr double kRadius = 0.022, kHeight = 0.12;

Cylinder grasp_object(double lean = 0.0) {
  Cylinder c{.radius = kRadius, .height = kHeight};
  c.X_WO = Eigen::Translation3d(0.4, 0.0, 0.1) * Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitX());
  return c;
}

/// E with z along `approach` and x along `across`, `offset` (in E) away from `point` of the
/// object.
Eigen::Isometry3d hand_at(const Eigen::Vector3d& point, const Eigen::Vector3d& approach,
                          const Eigen::Vector3d& across, const Eigen::Vector3d& offset) {
  Eigen::Isometry3d X_WE = Eigen::Isometry3d::Identity();
  X_WE.linear() << across, approach.cross(across), approach;
  X_WE.translation() = point - X_WE.linear() * offset;
  return X_WE;
}

/// The top of the object is at `p` in E, the hand points down.
bool precision(const Eigen::Vector3d& p) {
  const auto X_WE =
      hand_at({0.4, 0.0, 0.16}, -Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), p);
  return grasp_contact(kHand, Grip::precision, X_WE, grasp_object()).reachable;
}

/// The centre of the object is at `p` in E, the hand comes along +y of W.
bool full(const Eigen::Vector3d& p) {
  const auto X_WE = hand_at({0.4, 0.0, 0.1}, Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX(), p);
  return grasp_contact(kHand, Grip::full, X_WE, grasp_object()).reachable;
}

TEST(GraspContact, PrecisionGripHoldsWithinItsTolerances) {
  constexpr double kEdge = 0.029 - kRadius, kIn = 1e-6;
  EXPECT_TRUE(precision({0, 0, 0}));
  EXPECT_TRUE(precision({kEdge - kIn, 0, 0}));
  EXPECT_FALSE(precision({kEdge + kIn, 0, 0}));
  EXPECT_TRUE(precision({0, -0.016 + kIn, 0}));
  EXPECT_FALSE(precision({0, -0.016 - kIn, 0}));
  EXPECT_TRUE(precision({0, 0, 0.021 - kIn}));  // finger tips 5 mm past the top
  EXPECT_FALSE(precision({0, 0, 0.021 + kIn}));
  EXPECT_TRUE(precision({0, 0, -0.038 + kIn}));  // the palm touches the top
  EXPECT_FALSE(precision({0, 0, -0.038 - kIn}));
}

TEST(GraspContact, FullGripHoldsWithinItsTolerances) {
  constexpr double kEdge = 0.029 - kRadius, kIn = 1e-6;
  EXPECT_TRUE(full({0, 0, 0}));
  EXPECT_FALSE(full({-kEdge - kIn, 0, 0}));
  EXPECT_TRUE(full({0, 0.044 - kIn, 0}));  // 60 mm less half a finger
  EXPECT_FALSE(full({0, 0.044 + kIn, 0}));
  EXPECT_TRUE(full({0, 0, 0.021 - kIn}));
  EXPECT_FALSE(full({0, 0, 0.021 + kIn}));
  EXPECT_TRUE(full({0, 0, kRadius - 0.038 + kIn}));
  EXPECT_FALSE(full({0, 0, kRadius - 0.038 - kIn}));
}

TEST(GraspContact, TheHandMustComeFromTheGripsSide) {
  const auto down =
      hand_at({0.4, 0.0, 0.16}, -Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), {0, 0, 0});
  const auto up =
      hand_at({0.4, 0.0, 0.16}, Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), {0, 0, 0});
  const auto side =
      hand_at({0.4, 0.0, 0.1}, Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX(), {0, 0, 0});
  const auto pinched =
      hand_at({0.4, 0.0, 0.1}, Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ(), {0, 0, 0});
  EXPECT_FALSE(grasp_contact(kHand, Grip::full, down, grasp_object()).reachable);
  EXPECT_FALSE(grasp_contact(kHand, Grip::precision, side, grasp_object()).reachable);
  EXPECT_FALSE(grasp_contact(kHand, Grip::precision, up, grasp_object()).reachable);
  EXPECT_FALSE(grasp_contact(kHand, Grip::full, pinched, grasp_object()).reachable);
  EXPECT_FALSE(grasp_contact(kHand, Grip::unknown, down, grasp_object()).reachable);
}

TEST(GraspContact, LeaningTooFarIsNoGrasp) {
  const auto down =
      hand_at({0.4, 0.0, 0.16}, -Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX(), {0, 0, 0});
  EXPECT_TRUE(grasp_contact(kHand, Grip::precision, down, grasp_object(0.15)).reachable);
  EXPECT_FALSE(grasp_contact(kHand, Grip::precision, down, grasp_object(0.25)).reachable);
}

TEST(GraspContact, ClosureIsWhereTheApertureEqualsTheDiameter) {
  const double closure =
      grasp_contact(kHand, Grip::unknown, Eigen::Isometry3d::Identity(), grasp_object()).closure;
  EXPECT_NEAR(kHand.aperture * (1.0 - closure), 2 * kRadius, 1e-12);
  Cylinder thick = grasp_object();
  thick.radius = 0.03;  // wider than the open hand
  const auto X_WE =
      hand_at({0.4, 0.0, 0.1}, Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitX(), {0, 0, 0});
  EXPECT_FALSE(grasp_contact(kHand, Grip::full, X_WE, thick).reachable);
}

}  // namespace
}  // namespace mimesis::world
