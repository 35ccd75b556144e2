// Kinematics and dynamics of models/biped.urdf (36 velocities) and of its legs.
#include <benchmark/benchmark.h>

#include "common/robot/dynamics.h"
#include "common/robot/leg_ik.h"
#include "common/robot/test/random_motion.h"
#include "common/robot/test/test_bipeds.h"

namespace mimesis::robot {
namespace {

const Biped& biped() {
  static const Biped robot = hrp2_like();
  return robot;
}

void inverse_dynamics(benchmark::State& state) {
  Dynamics dynamics(biped().tree);
  const RobotMotion motion = random_motion(biped().tree, 1);
  Eigen::VectorXd torque(biped().tree.dof());
  for (auto _ : state) {
    benchmark::DoNotOptimize(dynamics.inverse_dynamics(motion, torque));
  }
}
BENCHMARK(inverse_dynamics)->Name("dynamics/inverse");

void ground_wrench(benchmark::State& state) {
  Dynamics dynamics(biped().tree);
  const RobotMotion motion = random_motion(biped().tree, 1);
  for (auto _ : state) benchmark::DoNotOptimize(dynamics.ground_wrench(motion));
}
BENCHMARK(ground_wrench)->Name("dynamics/ground_wrench");

/// With the links' poses, as DART's is.
void com_jacobian(benchmark::State& state) {
  const Dynamics dynamics(biped().tree);
  Kinematics kinematics(biped().tree);
  const RobotMotion motion = random_motion(biped().tree, 1);
  Eigen::Matrix3Xd J(3, 6 + biped().tree.dof());
  for (auto _ : state) {
    kinematics.update(motion.X_WB, motion.q);
    dynamics.com_jacobian(kinematics, J);
    benchmark::DoNotOptimize(J.data());
  }
}
BENCHMARK(com_jacobian)->Name("dynamics/com_jacobian_with_kinematics");

void com_jacobian_alone(benchmark::State& state) {
  const Dynamics dynamics(biped().tree);
  Kinematics kinematics(biped().tree);
  const RobotMotion motion = random_motion(biped().tree, 1);
  kinematics.update(motion.X_WB, motion.q);
  Eigen::Matrix3Xd J(3, 6 + biped().tree.dof());
  for (auto _ : state) {
    dynamics.com_jacobian(kinematics, J);
    benchmark::DoNotOptimize(J.data());
  }
}
BENCHMARK(com_jacobian_alone)->Name("dynamics/com_jacobian");

void leg_ik(benchmark::State& state) {
  const LegIk ik(biped(), kLeft);
  Kinematics kinematics(biped().tree);
  kinematics.update(Eigen::Isometry3d::Identity(), biped().half_sitting);
  Eigen::Isometry3d X_BS = kinematics.X_WL(biped().leg[kLeft].sole);
  X_BS.translation() += Eigen::Vector3d(0.1, 0.02, 0.03);
  for (auto _ : state) benchmark::DoNotOptimize(ik.solve(X_BS));
}
BENCHMARK(leg_ik)->Name("leg_ik");

}  // namespace
}  // namespace mimesis::robot
