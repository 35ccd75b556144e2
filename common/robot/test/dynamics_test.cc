#include "common/robot/dynamics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/robot/test/small_robot.h"
#include "common/robot/test/test_bipeds.h"
#include "common/robot/testing/momentum.h"

namespace mimesis::robot {
namespace {

using Eigen::Isometry3d, Eigen::Matrix3d, Eigen::Matrix3Xd, Eigen::Vector3d, Eigen::VectorXd;

RobotTree biped() { return read_urdf(std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf"); }
RobotTree small() { return read_urdf(write_urdf(kSmallRobot)); }

/// The motion after dt, by its velocities and accelerations (second order).
RobotMotion later(const RobotMotion& m, double dt) {
  RobotMotion out = m;
  out.q += dt * m.dq + 0.5 * dt * dt * m.ddq;
  out.dq += dt * m.ddq;
  out.X_WB.translation() += dt * m.v_W + 0.5 * dt * dt * m.a_W;
  out.v_W += dt * m.a_W;
  out.X_WB.linear() = math::exp_so3(dt * m.omega_W + 0.5 * dt * dt * m.alpha_W) * m.X_WB.linear();
  out.omega_W += dt * m.alpha_W;
  return out;
}

/// Two links: a base that stands, and a pendulum of a point mass nearly.
RobotTree pendulum(double mass, double length, double inertia) {
  Link base, rod;
  base.name = "base";
  rod.name = "rod";
  rod.joint = "swing";
  rod.parent = 0;
  rod.type = JointType::revolute;
  rod.axis = Vector3d::UnitY();
  rod.lower = -10.0;
  rod.upper = rod.max_speed = 10.0;
  rod.inertia = {.mass_kg = mass,
                 .com_m = Vector3d(0.0, 0.0, -length),
                 .about_com_kg_m2 = inertia * Matrix3d::Identity()};
  return {"pendulum", {base, rod}};
}

TEST(Dynamics, PendulumIsTheClosedForm) {
  const double m = 2.0, l = 0.7, I = 0.05;
  const RobotTree tree = pendulum(m, l, I);
  Dynamics dynamics(tree);
  RobotMotion motion(1);
  motion.q[0] = 0.4;
  motion.dq[0] = 1.5;
  motion.ddq[0] = -3.0;
  VectorXd torque(1);
  const Wrench ground = dynamics.inverse_dynamics(motion, torque);
  const double s = std::sin(0.4), c = std::cos(0.4);
  EXPECT_NEAR(torque[0], (I + m * l * l) * -3.0 + m * kGravity * l * s, 1e-12);
  // CoM at (−l s, 0, −l c); its acceleration gives the force
  const Vector3d force(m * l * (s * 1.5 * 1.5 + c * 3.0), 0.0,
                       m * (l * (c * 1.5 * 1.5 - s * 3.0) + kGravity));
  EXPECT_LT((ground.force - force).norm(), 1e-12);
  EXPECT_NEAR(ground.moment.y(), torque[0], 1e-12);  // the base adds nothing
}

TEST(Dynamics, StandingRobotWeighsItsMassAboveItsCom) {
  const RobotTree tree = biped();
  Dynamics dynamics(tree);
  RobotMotion motion(tree.dof());
  motion.q = random_motion(tree, 3).q;
  motion.X_WB.translation() = Vector3d(5.0, -2.0, 0.7);
  Kinematics kinematics(tree);
  kinematics.update(motion.X_WB, motion.q);
  const Wrench ground = dynamics.ground_wrench(motion);
  EXPECT_LT((ground.force - Vector3d(0.0, 0.0, 58.0 * kGravity)).norm(), 1e-9);
  for (const double height : {0.0, 0.3}) {
    EXPECT_LT((zmp_of(ground, height) - kinematics.com().head<2>()).norm(), 1e-12);
  }
}

TEST(Dynamics, ZmpIsWhereTheMomentIsVertical) {
  const Wrench ground{.force = Vector3d(30.0, -20.0, 500.0), .moment = Vector3d(7.0, -11.0, 3.0)};
  for (const double height : {0.0, 0.2}) {
    Vector3d p;
    p << zmp_of(ground, height), height;
    EXPECT_LT((ground.moment - p.cross(ground.force)).head<2>().norm(), 1e-12);
  }
}

TEST(Dynamics, LinearMomentumIsMassTimesComJacobian) {
  for (const RobotTree& tree : {small(), biped()}) {
    Dynamics dynamics(tree);
    Kinematics kinematics(tree);
    Matrix3Xd J(3, 6 + tree.dof());
    VectorXd nu(6 + tree.dof());
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const RobotMotion m = random_motion(tree, seed);
      kinematics.update(m.X_WB, m.q);
      dynamics.com_jacobian(kinematics, J);
      nu << m.v_W, m.omega_W, m.dq;
      EXPECT_LT((tree.mass_kg() * J * nu - momentum(tree, m).linear_W).norm(), 1e-11);
    }
  }
}

TEST(Dynamics, GroundWrenchIsTheRateOfTheMomenta) {
  constexpr double kDt = 1e-5;
  for (const RobotTree& tree : {small(), biped()}) {
    Dynamics dynamics(tree);
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const RobotMotion m = random_motion(tree, seed);
      const Momentum now = momentum(tree, m), before = momentum(tree, later(m, -kDt)),
                     after = momentum(tree, later(m, kDt));
      const Vector3d weight(0.0, 0.0, tree.mass_kg() * kGravity);
      const Vector3d force = weight + (after.linear_W - before.linear_W) / (2.0 * kDt);
      const Vector3d moment =
          (after.angular_W - before.angular_W) / (2.0 * kDt) + now.com_W_m.cross(force);
      const Wrench ground = dynamics.ground_wrench(m);
      EXPECT_LT((ground.force - force).norm(), 1e-5 * force.norm());
      EXPECT_LT((ground.moment - moment).norm(), 1e-5 * moment.norm());
    }
  }
}

/// Power of all that drives the robot against the rate of its energy.
TEST(Dynamics, PowerIsTheRateOfTheEnergy) {
  constexpr double kDt = 1e-5;
  for (const RobotTree& tree : {small(), biped()}) {
    Dynamics dynamics(tree);
    Kinematics kinematics(tree);
    Jacobian J(6, 6 + tree.dof());
    const auto energy = [&](const RobotMotion& m) {
      kinematics.update(m.X_WB, m.q);
      VectorXd nu(6 + tree.dof());
      nu << m.v_W, m.omega_W, m.dq;
      double sum = tree.mass_kg() * kGravity * kinematics.com().z();
      for (std::size_t l = 0; l < tree.links().size(); ++l) {
        const Inertia& inertia = tree.links()[l].inertia;
        const Isometry3d& X = kinematics.X_WL(static_cast<int>(l));
        kinematics.jacobian(static_cast<int>(l), X * inertia.com_m, J);
        const Eigen::Matrix<double, 6, 1> v = J * nu;
        const Vector3d w = X.linear().transpose() * v.tail<3>();
        sum += 0.5 * inertia.mass_kg * v.head<3>().squaredNorm() +
               0.5 * w.dot(inertia.about_com_kg_m2 * w);
      }
      return sum;
    };
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const RobotMotion m = random_motion(tree, seed);
      VectorXd torque(tree.dof());
      const Wrench ground = dynamics.inverse_dynamics(m, torque);
      const Vector3d about_base = ground.moment - m.X_WB.translation().cross(ground.force);
      const double power = torque.dot(m.dq) + ground.force.dot(m.v_W) + about_base.dot(m.omega_W);
      const double rate = (energy(later(m, kDt)) - energy(later(m, -kDt))) / (2.0 * kDt);
      EXPECT_NEAR(power, rate, 1e-5 * std::abs(rate) + 1e-4);
    }
  }
}

TEST(Dynamics, GroundWrenchIsThatOfInverseDynamics) {
  const RobotTree tree = biped();
  Dynamics dynamics(tree);
  const RobotMotion m = random_motion(tree, 9);
  VectorXd torque(tree.dof());
  const Wrench a = dynamics.inverse_dynamics(m, torque), b = dynamics.ground_wrench(m);
  EXPECT_EQ(a.force, b.force);
  EXPECT_EQ(a.moment, b.moment);
}

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
