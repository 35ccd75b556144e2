// DART on the same robot and motion; 14 µs and 23 µs were measured on another machine.
#include <benchmark/benchmark.h>

#include <dart/dart.hpp>
#include <dart/utils/urdf/urdf.hpp>

#include "common/robot/test/random_motion.h"

namespace mimesis::robot {
namespace {

const std::string kUrdf = std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf";

/// The motion in DART's order. Values are arbitrary all the same: the first six count as joints.
void set(dart::dynamics::Skeleton& skeleton, const RobotMotion& motion) {
  Eigen::VectorXd q(36), dq(36), ddq(36);
  q << Eigen::VectorXd::Constant(6, 0.1), motion.q;
  dq << motion.v_W, motion.omega_W, motion.dq;
  ddq << motion.a_W, motion.alpha_W, motion.ddq;
  skeleton.setPositions(q);
  skeleton.setVelocities(dq);
  skeleton.setAccelerations(ddq);
}

void inverse_dynamics(benchmark::State& state) {
  const auto skeleton = dart::utils::DartLoader().parseSkeleton(kUrdf);
  const RobotMotion motion = random_motion(read_urdf(kUrdf), 1);
  for (auto _ : state) {
    set(*skeleton, motion);
    skeleton->computeInverseDynamics();
    benchmark::DoNotOptimize(skeleton->getForce(8));
  }
}
BENCHMARK(inverse_dynamics)->Name("peer/dart/inverse_dynamics");

void com_jacobian(benchmark::State& state) {
  const auto skeleton = dart::utils::DartLoader().parseSkeleton(kUrdf);
  const RobotMotion motion = random_motion(read_urdf(kUrdf), 1);
  for (auto _ : state) {
    set(*skeleton, motion);
    benchmark::DoNotOptimize(skeleton->getCOMLinearJacobian());
  }
}
BENCHMARK(com_jacobian)->Name("peer/dart/com_jacobian");

}  // namespace
}  // namespace mimesis::robot
