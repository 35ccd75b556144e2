// MuJoCo against closed forms and our own equations of motion; then walks in it. Skipped where
// npm's package cannot be had.
#include <gtest/gtest.h>

#include <cstdlib>

#include "common/robot/dynamics.h"
#include "experiments/walk/mujoco/mujoco_world.h"
#include "experiments/walk/trial/trial.h"

namespace mimesis::walk {
namespace {

using hw::sim::BodyOptions;
using hw::sim::Plant;
using robot::kGravity;
using robot::Side;

constexpr double kDt_s = 0.001;

const Robot& biped() {
  static const Robot robot = load_robot("biped");
  return robot;
}
const robot::RobotTree& tree() { return biped().biped.tree; }

class MujocoPeer : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string install =
        MIMESIS_SOURCE_DIR "/tests/peer/install " MIMESIS_BIN_DIR "/.. >/dev/null";
    installed_ = std::system(install.c_str()) == 0 && !mujoco_package().empty();
  }
  void SetUp() override {
    if (!installed_) GTEST_SKIP() << "no MuJoCo of npm, or no node";
  }
  static bool installed_;
};
bool MujocoPeer::installed_ = false;

void hold(MujocoWorld& world, double duration_s) {
  const Eigen::VectorXd& q = biped().biped.half_sitting;
  world.step({q.data(), static_cast<std::size_t>(q.size())}, duration_s);
}

TEST_F(MujocoPeer, StartsWhereOurKinematicsHasEveryLink) {
  const MujocoWorld world(biped().biped, {});
  robot::Kinematics kinematics(tree());
  kinematics.update(biped().biped.X_WB_half_sitting, biped().biped.half_sitting);
  for (int i = 0; i < static_cast<int>(tree().links().size()); ++i) {
    EXPECT_TRUE(world.X_WL(i).isApprox(kinematics.X_WL(i), 1e-12)) << tree().link(i).name;
  }
  EXPECT_NEAR(world.truth().com_W_m.z(), biped().biped.com_height_m, 1e-12);
}

/// A step of MuJoCo, and what our recursive Newton-Euler says of its motion.
class Step {
 public:
  explicit Step(MujocoWorld& world) : world_(&world), motion_(tree().dof()) {}

  /// `force_W`: pushes `link` at its centre of mass in this step.
  void run(const Eigen::VectorXd& target, int link, const Eigen::Vector3d& force_W) {
    const hw::sim::BodySensors before = world_->sensors();
    motion_.X_WB = world_->truth().X_WB;
    soles_ = world_->truth().X_WS;
    point_W_ = world_->X_WL(link) * tree().link(link).inertia.com_m;
    force_W_ = force_W;
    world_->push({.at_s = 0.0,
                  .duration_s = kDt_s,
                  .impulse_W_ns = force_W * kDt_s,
                  .link = tree().link(link).name});
    world_->step({target.data(), static_cast<std::size_t>(target.size())}, kDt_s);
    const hw::sim::BodySensors& after = world_->sensors();
    // MuJoCo integrates the velocity in W and the turning in B [its documentation, "free joint"],
    // then the position with the new velocity. The pelvis is both B and the IMU's link.
    const Eigen::Isometry3d& X_WB = world_->truth().X_WB;
    const Eigen::Matrix3d& R_WB = motion_.X_WB.linear();
    motion_.a_W = X_WB.linear() * after.specific_force_I - kGravity * Eigen::Vector3d::UnitZ();
    motion_.v_W = (X_WB.translation() - motion_.X_WB.translation()) / kDt_s - kDt_s * motion_.a_W;
    motion_.omega_W = R_WB * before.gyro_I;
    motion_.alpha_W = R_WB * (after.gyro_I - before.gyro_I) / kDt_s;
    motion_.q = before.q;
    motion_.dq = before.dq;
    motion_.ddq = (after.dq - before.dq) / kDt_s;
    robot::Dynamics dynamics(tree());
    torque_ = Eigen::VectorXd::Zero(tree().dof());
    wanted_ = dynamics.inverse_dynamics(motion_, torque_);
  }

  /// Wrench that the motion asks for beyond those of ground and push, about the origin of W.
  robot::Wrench missing() const {
    robot::Wrench missing = wanted_;
    const auto take = [&](const Eigen::Vector3d& point_W, const Eigen::Vector3d& force_W) {
      missing.force -= force_W;
      missing.moment -= point_W.cross(force_W);
    };
    take(point_W_, force_W_);
    for (const Side side : robot::kSides) {
      const robot::Wrench& foot_S = world_->sensors().foot_S[side];
      take(soles_[side].translation(), soles_[side].linear() * foot_S.force);
      missing.moment -= soles_[side].linear() * foot_S.moment;
    }
    return missing;
  }
  const robot::Wrench& wanted() const { return wanted_; }
  const robot::RobotMotion& motion() const { return motion_; }

 private:
  MujocoWorld* world_;
  robot::RobotMotion motion_;
  std::array<Eigen::Isometry3d, 2> soles_;
  Eigen::Vector3d point_W_, force_W_;
  Eigen::VectorXd torque_;
  robot::Wrench wanted_;
};

// Masses, centres of mass and inertias of all links, the sensors' frames and the ground's wrenches
// in one: any motion takes the wrench that Newton and Euler say.
TEST_F(MujocoPeer, MovesAsOurEquationsOfMotionSay) {
  for (const Plant plant : {Plant::springs, Plant::servo}) {
    BodyOptions options;
    options.plant = plant;
    MujocoWorld world(biped().biped, options);
    Step step(world);
    Eigen::VectorXd target = biped().biped.half_sitting;
    for (int k = 0; k < 60; ++k) {
      for (Eigen::Index i = 0; i < target.size(); ++i) {
        target[i] += 1e-3 * std::sin(0.05 * k + 1.7 * static_cast<double>(i));
      }
      const Eigen::Vector3d push(30.0 * std::sin(0.1 * k), 20.0, 10.0 * std::cos(0.2 * k));
      step.run(target, tree().require_link(k % 2 == 0 ? "head" : "left_foot"), push);
      EXPECT_LT(step.missing().force.norm(), 1e-3) << k;
      EXPECT_LT(step.missing().moment.norm(), 1e-3) << k;
    }
    EXPECT_GT(step.motion().ddq.cwiseAbs().maxCoeff(), 1.0) << "a test of nothing that moves";
  }
}

TEST_F(MujocoPeer, StandsOnItsWeight) {
  MujocoWorld world(biped().biped, {});
  hold(world, 0.5);
  double sum_n = 0.0, deepest_m = 0.0;
  const std::array<Eigen::Isometry3d, 2> start = world.truth().X_WS;
  constexpr int kTicks = 400;
  for (int i = 0; i < kTicks; ++i) {
    hold(world, 0.005);
    for (const Side side : robot::kSides) {
      sum_n += world.truth().normal_n[side] / kTicks;
      deepest_m = std::max(deepest_m, -world.truth().X_WS[side].translation().z());
    }
  }
  EXPECT_NEAR(sum_n / (tree().mass_kg() * kGravity), 1.0, 0.002);
  EXPECT_GT(deepest_m, 0.0);
  EXPECT_LT(deepest_m, 1e-4) << "soft ground";
  for (const Side side : robot::kSides) {  // 2 s
    const Eigen::Vector3d crept = world.truth().X_WS[side].translation() -
                                  start[static_cast<std::size_t>(side)].translation();
    EXPECT_LT(crept.norm(), 2e-4);
  }
}

// Lifted by a push, it leaves the ground and falls freely.
TEST_F(MujocoPeer, PushesChangeTheMomentumAndFlightIsAParabola) {
  MujocoWorld world(biped().biped, {});
  hold(world, 0.2);
  const double mass = tree().mass_kg(), impulse_ns = 180.0;
  world.push({.at_s = 0.2, .duration_s = 0.1, .impulse_W_ns = {10.0, -5.0, impulse_ns}});
  const Eigen::Vector3d v_start = world.truth().com_v_W;
  Eigen::Vector3d ground_ns = Eigen::Vector3d::Zero();
  for (int i = 0; i < 120; ++i) {  // step by step: contacts belong to the soles' pose before each
    const std::array<Eigen::Isometry3d, 2> X_WS = world.truth().X_WS;
    hold(world, kDt_s);
    for (const Side side : robot::kSides) {
      ground_ns += kDt_s * (X_WS[side].linear() * world.sensors().foot_S[side].force);
    }
  }
  const Eigen::Vector3d gained = mass * (world.truth().com_v_W - v_start);
  const Eigen::Vector3d given =
      Eigen::Vector3d(10.0, -5.0, impulse_ns - mass * kGravity * 0.12) + ground_ns;
  EXPECT_LT((gained - given).norm(), 1e-3 * impulse_ns);
  ASSERT_GT(world.truth().com_v_W.z(), 0.5);

  const hw::sim::BodyTruth left = world.truth();
  hold(world, 0.1);
  EXPECT_EQ(world.truth().most_normal_n, 0.0);
  EXPECT_NEAR(world.truth().com_v_W.z(), left.com_v_W.z() - 0.1 * kGravity, 1e-4);
  EXPECT_NEAR(world.truth().com_v_W.x(), left.com_v_W.x(), 1e-4);
  EXPECT_NEAR(world.truth().com_W_m.z(),
              left.com_W_m.z() + 0.1 * left.com_v_W.z() - 0.5 * kGravity * 0.1 * 0.1, 1e-3);
}

TEST_F(MujocoPeer, FeetSlideOnTheFrictionCone) {
  BodyOptions options;
  options.friction = 0.3;
  MujocoWorld world(biped().biped, options);
  hold(world, 0.2);
  // a foot weighs far less than it takes to hold it: 400 N against 0.3·290 N, not along an axis
  const int foot = biped().biped.leg[robot::kLeft].foot;
  world.push({.at_s = 0.2,
              .duration_s = 0.02,
              .impulse_W_ns = {6.0, 5.3, 0.0},
              .link = tree().link(foot).name});
  double most = 0.0;
  for (int i = 0; i < 20; ++i) {
    hold(world, kDt_s);
    for (const Side side : robot::kSides) {
      const Eigen::Vector3d& f_S = world.sensors().foot_S[side].force;
      if (f_S.z() > 10.0) most = std::max(most, f_S.head<2>().norm() / f_S.z());
    }
  }
  EXPECT_NEAR(most, options.friction, 1e-3);
}

TEST_F(MujocoPeer, ServosGoAsFastAsTheirErrorAsks) {
  // MuJoCo solves constraints without the implicit part of the dampers, which moves them a little
  constexpr double kImplicit = 0.02;
  BodyOptions options;
  options.plant = Plant::servo;
  options.motor_torque_share = 100.0;  // to stop within a step takes more than it has
  MujocoWorld world(biped().biped, options);
  hold(world, 0.1);
  const int joint = tree().require_joint("waist_yaw");
  Eigen::VectorXd target = biped().biped.half_sitting;
  target[joint] += 0.5;
  double fastest = 0.0;
  for (int i = 0; i < 300; ++i) {
    const double before = world.sensors().q[joint];
    world.step({target.data(), static_cast<std::size_t>(target.size())}, kDt_s);
    fastest = std::max(fastest, world.sensors().dq[joint]);
    if (i == 130) {  // the ramp has arrived: the error falls by 200/s
      const double wanted = 200.0 * (target[joint] - before);
      EXPECT_GT(wanted, 0.5);
      EXPECT_NEAR(world.sensors().dq[joint], wanted, kImplicit * wanted);
    }
  }
  const double most = tree().moved(joint).max_speed;
  EXPECT_NEAR(fastest, most, kImplicit * most);
  EXPECT_NEAR(world.sensors().q[joint], target[joint], 1e-4);
}

TEST_F(MujocoPeer, ServosHaveTheTorqueOfTheirMotors) {
  BodyOptions options;
  options.plant = Plant::servo;
  options.motor_torque_share = 0.2;
  MujocoWorld world(biped().biped, options);
  hold(world, 0.1);
  const int joint = tree().require_joint("waist_yaw");
  const double limit = 0.2 * tree().moved(joint).max_effort;
  Eigen::VectorXd target = biped().biped.half_sitting;
  double most = 0.0;
  for (int i = 0; i < 100; ++i) {
    target[joint] += 0.004 * (i % 20 < 10 ? 1.0 : -1.0);  // back and forth as fast as it goes
    world.step({target.data(), static_cast<std::size_t>(target.size())}, kDt_s);
    most = std::max(most, std::abs(world.sensors().torque[joint]));
  }
  EXPECT_DOUBLE_EQ(most, limit);
}

TEST_F(MujocoPeer, EncodersOnTheMotorsDoNotSeeTheSprings) {
  BodyOptions options;
  options.senses.motor_encoders = true;
  MujocoWorld motors(biped().biped, options), joints(biped().biped, {});
  hold(motors, 0.3);
  hold(joints, 0.3);
  const int knee = biped().biped.leg[robot::kLeft].dof[robot::kKnee];
  EXPECT_EQ(motors.sensors().q[knee], biped().biped.half_sitting[knee]);
  EXPECT_GT(std::abs(joints.sensors().q[knee] - biped().biped.half_sitting[knee]), 1e-3);
  EXPECT_EQ(motors.truth().com_W_m, joints.truth().com_W_m) << "sensors move no robot";
}

TrialSpec walk(Plant plant, double duration_s) {
  TrialSpec spec;
  spec.robot = &biped();
  spec.engine = Engine::mujoco;
  spec.body.plant = plant;
  spec.duration_s = duration_s;
  spec.wish = [](double) {
    walker::WalkerWish w;
    w.walk.velocity_m_s.x() = 0.2;
    return w;
  };
  return spec;
}

TEST_F(MujocoPeer, FourStepsLandWhereTheyArePlanned) {
  for (const Plant plant : {Plant::servo}) {
    const TrialResult r = run_trial(walk(plant, 4.4));
    EXPECT_FALSE(r.figures.fell) << r.figures.how;
    EXPECT_EQ(r.trouble, "");
    EXPECT_GE(r.figures.steps, 4);
    EXPECT_GT(r.walked_m, 0.4);
    EXPECT_LT(r.figures.step_error_max_m, 0.01);
    EXPECT_LT(r.figures.ankle_pitch_slow_peak_n_m, 30.0);
    EXPECT_LT(r.figures.normal_peak_n, 800.0);
  }
}

TEST_F(MujocoPeer, WithoutFeedbackAPushIsAFall) {
  TrialSpec spec = walk(Plant::springs, 8.0);
  spec.walker.stabilize = spec.walker.filter = false;
  spec.pushes.push_back({.at_s = 4.0, .duration_s = 0.1, .impulse_W_ns = {10.0, 10.0, 0.0}});
  EXPECT_TRUE(run_trial(spec).figures.fell) << "a test of falling that nobody can fail";
}

TEST_F(MujocoPeer, SameTrialGivesTheSameBits) {
  const TrialResult a = run_trial(walk(Plant::springs, 1.5)),
                    b = run_trial(walk(Plant::springs, 1.5));
  EXPECT_EQ(a.dcm_max_m, b.dcm_max_m);
  EXPECT_EQ(a.figures.raw_normal_peak_n, b.figures.raw_normal_peak_n);
}

}  // namespace
}  // namespace mimesis::walk
