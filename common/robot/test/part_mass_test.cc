#include <gtest/gtest.h>

#include "common/robot/dynamics.h"
#include "common/robot/test/random_motion.h"
#include "common/robot/test/small_robot.h"
#include "common/robot/test/test_bipeds.h"

namespace mimesis::robot {
namespace {

using Eigen::Isometry3d, Eigen::Vector3d, Eigen::VectorXd;

TEST(PartMass, PartsOfABipedGiveItsCentreOfMass) {
  const Biped biped = hrp2_like();
  PartMass left(biped.tree, biped.leg[kLeft].dof, false), upper(biped.tree, biped.upper_body, true);
  std::array<int, 6> turned_round = biped.leg[kRight].dof;
  std::ranges::reverse(turned_round);
  PartMass right(biped.tree, turned_round, false);
  EXPECT_NEAR(left.mass_kg() + right.mass_kg() + upper.mass_kg(), 58.0, 1e-9);
  EXPECT_NEAR(left.mass_kg(), right.mass_kg(), 1e-12);
  Kinematics kinematics(biped.tree);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const VectorXd q = random_motion(biped.tree, seed).q;
    kinematics.update(Isometry3d::Identity(), q);
    const Vector3d moment = left.first_moment(q(biped.leg[kLeft].dof)) +
                            right.first_moment(q(turned_round)) +
                            upper.first_moment(q(biped.upper_body));
    EXPECT_LT((moment / 58.0 - kinematics.com()).norm(), 1e-12);
  }
}

TEST(PartMass, TakesJointsThatSlide) {
  const RobotTree tree = read_urdf(write_urdf(kSmallRobot));
  const std::array dofs{0, 1, 2};
  PartMass whole(tree, dofs, true);
  Kinematics kinematics(tree);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const VectorXd q = random_motion(tree, seed).q;
    kinematics.update(Isometry3d::Identity(), q);
    EXPECT_LT((whole.first_moment(q) / tree.mass_kg() - kinematics.com()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace mimesis::robot
