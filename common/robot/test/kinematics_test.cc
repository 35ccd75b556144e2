#include "common/robot/kinematics.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "common/math/so3.h"
#include "common/robot/test/small_robot.h"
#include "common/robot/test/test_bipeds.h"
#include "common/shared_data.h"

namespace mimesis::robot {
namespace {

using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Vector3d, Eigen::VectorXd;

std::string biped_urdf() { return std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf"; }
/// JVRC-1's file, or nothing without the shared folder.
std::string jvrc1_urdf() {
  const std::string file = shared_data("data/robots/jvrc1.urdf").string();
  return std::filesystem::exists(file) ? file : "";
}

struct Posture {
  Isometry3d X_WB = Isometry3d::Identity();
  VectorXd q;
};

Posture random_posture(const RobotTree& tree, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Posture p;
  p.q = VectorXd::NullaryExpr(tree.dof(), [&] { return 0.8 * unit(random); });
  p.X_WB.linear() = math::exp_so3({unit(random), unit(random), unit(random)});
  p.X_WB.translation() = Vector3d(unit(random), unit(random), unit(random));
  return p;
}

/// The posture after moving along generalised velocity number `column` for `step`.
Posture moved(Posture p, Eigen::Index column, double step) {
  if (column < 3) p.X_WB.translation()[column] += step;
  if (column >= 3 && column < 6) {
    p.X_WB.linear() = math::exp_so3(step * Vector3d::Unit(column - 3)) * p.X_WB.linear();
  }
  if (column >= 6) p.q[column - 6] += step;
  return p;
}

/// Largest difference between the Jacobian of a point of every link and central differences.
double jacobian_error(const RobotTree& tree, unsigned seed) {
  constexpr double kStep = 1e-6;
  const Posture posture = random_posture(tree, seed);
  const Vector3d p_L(0.1, -0.2, 0.3);
  Kinematics here(tree), there(tree);
  here.update(posture.X_WB, posture.q);
  Jacobian J(6, 6 + tree.dof());
  double worst = 0.0;
  for (int link = 0; link < static_cast<int>(tree.links().size()); ++link) {
    here.jacobian(link, here.X_WL(link) * p_L, J);
    for (Eigen::Index c = 0; c < J.cols(); ++c) {
      Isometry3d X[2];
      for (const int side : {0, 1}) {
        const Posture p = moved(posture, c, side == 0 ? -kStep : kStep);
        there.update(p.X_WB, p.q);
        X[side] = there.X_WL(link);
      }
      Eigen::Matrix<double, 6, 1> difference;
      difference << X[1] * p_L - X[0] * p_L,
          math::log_so3(X[1].linear() * X[0].linear().transpose());
      worst = std::max(worst, (difference / (2.0 * kStep) - J.col(c)).cwiseAbs().maxCoeff());
    }
  }
  return worst;
}

TEST(Kinematics, PutsTheSmallRobotsLinksWhereTheyBelong) {
  const RobotTree tree = read_urdf(write_urdf(kSmallRobot));
  Kinematics k(tree);
  Isometry3d X_WB = Isometry3d::Identity();
  X_WB.translation() = Vector3d(1.0, 0.0, 0.0);
  k.update(X_WB, VectorXd::Zero(3));
  const int arm = tree.find_link("arm"), rod = tree.find_link("rod");
  EXPECT_LT((k.X_WL(rod).translation() - Vector3d(1.1, 0.2, -0.1)).norm(), 1e-12);
  // x of the arm is y of the base (yaw 90°), so a turn by π about (0.6, 0, 0.8) of the arm is one
  // about (0, 0.6, 0.8) of the base: z goes to 2·0.8·(0, 0.6, 0.8) − z
  k.update(X_WB, Vector3d(std::numbers::pi, 0.0, 0.0));
  EXPECT_LT((k.X_WL(arm).linear().col(2) - Vector3d(0.0, 0.96, 0.28)).norm(), 1e-9);
  k.update(X_WB, Vector3d(0.0, 0.15, 0.0));
  const Matrix3d R_PJ = tree.link(rod).X_PJ.linear();
  const Vector3d along = k.X_WL(arm).linear() * R_PJ * Vector3d::UnitY();
  EXPECT_LT((k.X_WL(rod).translation() - Vector3d(1.1, 0.2, -0.1) - 0.15 * along).norm(), 1e-12);
}

TEST(Kinematics, JacobianIsTheDerivative) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    EXPECT_LT(jacobian_error(read_urdf(write_urdf(kSmallRobot)), seed), 1e-8);
    EXPECT_LT(jacobian_error(read_urdf(biped_urdf()), seed), 1e-8);
  }
}

TEST(Kinematics, HalfSittingBipedStandsOnItsSoles) {
  const RobotTree tree = read_urdf(biped_urdf());
  VectorXd q = VectorXd::Zero(tree.dof());
  for (const std::string side : {"left", "right"}) {
    const auto set = [&](const std::string& joint, double degrees) {
      q[tree.require_joint(side + '_' + joint)] = degrees * kDegree;
    };
    const double sign = side == "left" ? 1.0 : -1.0;
    set("hip_pitch", -26);
    set("knee", 50);
    set("ankle_pitch", -24);
    set("shoulder_pitch", 15);
    set("shoulder_roll", 10 * sign);
    set("elbow", -30);
    set("gripper", -10 * sign);
  }
  EXPECT_TRUE((q.array() >= tree.lower().array()).all());
  EXPECT_TRUE((q.array() <= tree.upper().array()).all());
  Kinematics k(tree);
  Isometry3d X_WB = Isometry3d::Identity();
  X_WB.translation().z() = 0.648702;
  k.update(X_WB, q);
  for (const std::string side : {"left", "right"}) {
    const Isometry3d& sole = k.X_WL(tree.require_link(side + "_sole"));
    EXPECT_LT((sole.linear() - Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(sole.translation().z(), 0.0, 1e-5);  // the published pelvis height
    EXPECT_NEAR(sole.translation().x(), 0.00949, 1e-5);
    EXPECT_NEAR(sole.translation().y(), side == "left" ? 0.095 : -0.095, 1e-12);
    const Isometry3d& grip = k.X_WL(tree.require_link(side + "_grip"));
    EXPECT_GT(grip.translation().x(), 0.05);                             // before the hips
    EXPECT_GT(grip.translation().y() * (side == "left" ? 1 : -1), 0.3);  // away from the body
  }
  EXPECT_GT(k.com().z(), 0.80);
  EXPECT_LT(k.com().z(), 0.81);
  EXPECT_NEAR(k.com().y(), 0.0, 1e-12);
}

TEST(Kinematics, AnotherRobotReadsAsWell) {
  if (jvrc1_urdf().empty())
    GTEST_SKIP() << "not here: needs data/robots/jvrc1.urdf of the shared folder";
  const RobotTree tree = read_urdf(jvrc1_urdf());
  EXPECT_EQ(tree.dof(), 44);
  EXPECT_NEAR(tree.mass_kg(), 62.4, 0.05);
  EXPECT_EQ(tree.link(tree.require_link("L_UINDEX_S")).mimics, "L_UTHUMB");
  EXPECT_LT(jacobian_error(tree, 4), 1e-8);
  Kinematics k(tree);
  const double leg = (k.X_WL(tree.require_link("l_ankle")).translation() -
                      k.X_WL(tree.require_link("L_KNEE_S")).translation())
                         .norm();
  EXPECT_NEAR(leg, std::hypot(0.357, 0.04), 1e-9);
}

}  // namespace
}  // namespace mimesis::robot
