// Dynamics against DART, an independent implementation with a URDF reader of its own.
#include <gtest/gtest.h>

#include <dart/dart.hpp>
#include <dart/utils/urdf/urdf.hpp>
#include <fstream>

#include "common/robot/dynamics.h"
#include "common/robot/test/test_bipeds.h"
#include "common/shared_data.h"

namespace mimesis::robot {
namespace {

using Eigen::Matrix3Xd, Eigen::Vector3d, Eigen::VectorXd;

/// The file's text without shapes: DART gives up on a mesh that is not there.
std::string without_shapes(const std::string& urdf) {
  std::ifstream in(urdf);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  for (const std::string element : {"visual", "collision"}) {
    const std::string end = "</" + element + ">";
    for (std::size_t at; (at = text.find('<' + element + '>')) != std::string::npos;) {
      text.erase(at, text.find(end, at) + end.size() - at);
    }
  }
  return text;
}

/// The robot in DART.
class Peer {
 public:
  Peer(const std::string& urdf, const RobotTree& tree) : tree_(tree) {
    skeleton_ = dart::utils::DartLoader().parseSkeletonString(without_shapes(urdf), "");
    if (!skeleton_) throw std::runtime_error("DART does not read " + urdf);
    skeleton_->setGravity(Vector3d(0.0, 0.0, -kGravity));
    for (const Link& link : tree.links()) {  // DART takes 1 kg for a link without mass
      if (link.inertia.mass_kg == 0.0) {
        skeleton_->getBodyNode(link.name)->setInertia(
            dart::dynamics::Inertia(1e-20, Vector3d::Zero(), 1e-20 * Eigen::Matrix3d::Identity()));
      }
    }
  }

  void set(const RobotMotion& m) {
    using dart::dynamics::Frame;
    for (int i = 0; i < tree_.dof(); ++i) {
      auto* joint = skeleton_->getJoint(tree_.moved(i).joint);
      joint->setPosition(0, m.q[i]);
      joint->setVelocity(0, m.dq[i]);
      joint->setAcceleration(0, m.ddq[i]);
    }
    auto* base = static_cast<dart::dynamics::FreeJoint*>(skeleton_->getRootJoint());
    base->setTransform(m.X_WB);
    base->setLinearVelocity(m.v_W, Frame::World(), Frame::World());
    base->setAngularVelocity(m.omega_W, Frame::World(), Frame::World());
    base->setLinearAcceleration(m.a_W, Frame::World(), Frame::World());
    base->setAngularAcceleration(m.alpha_W, Frame::World(), Frame::World());
  }

  /// Torques in our order, and the wrench on the base about the origin of W.
  Wrench inverse_dynamics(const RobotMotion& m, VectorXd& torque) {
    skeleton_->computeInverseDynamics();
    for (int i = 0; i < tree_.dof(); ++i) {
      torque[i] = skeleton_->getJoint(tree_.moved(i).joint)->getForce(0);
    }
    // wrench of the root's joint: moment, then force, about the base's origin and in its axes
    const Eigen::Matrix<double, 6, 1> f = skeleton_->getRootJoint()->getForces();
    Wrench ground;
    ground.force = m.X_WB.linear() * f.tail<3>();
    ground.moment = m.X_WB.linear() * f.head<3>() + m.X_WB.translation().cross(ground.force);
    return ground;
  }

  Vector3d com() const { return skeleton_->getCOM(); }
  Vector3d com_velocity() const { return skeleton_->getCOMLinearVelocity(); }
  /// Column of our joint `i`.
  Vector3d com_jacobian_column(int i) const {
    const auto* dof = skeleton_->getJoint(tree_.moved(i).joint)->getDof(0);
    return skeleton_->getCOMLinearJacobian().col(
        static_cast<Eigen::Index>(dof->getIndexInSkeleton()));
  }

 private:
  const RobotTree& tree_;
  dart::dynamics::SkeletonPtr skeleton_;
};

void compare(const std::string& urdf) {
  const RobotTree tree = read_urdf(urdf);
  Dynamics dynamics(tree);
  Kinematics kinematics(tree);
  Peer peer(urdf, tree);
  VectorXd ours(tree.dof()), theirs(tree.dof()), nu(6 + tree.dof());
  Matrix3Xd J(3, 6 + tree.dof());
  double worst_torque = 0.0, worst_wrench = 0.0, worst_com = 0.0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const RobotMotion m = random_motion(tree, seed);
    peer.set(m);
    const Wrench a = dynamics.inverse_dynamics(m, ours), b = peer.inverse_dynamics(m, theirs);
    kinematics.update(m.X_WB, m.q);
    dynamics.com_jacobian(kinematics, J);
    nu << m.v_W, m.omega_W, m.dq;
    // relative to the size of the largest
    worst_torque = std::max(worst_torque, (ours - theirs).norm() / theirs.norm());
    worst_wrench = std::max({worst_wrench, (a.force - b.force).norm() / b.force.norm(),
                             (a.moment - b.moment).norm() / b.moment.norm()});
    worst_com = std::max(
        {worst_com, (kinematics.com() - peer.com()).norm(), (J * nu - peer.com_velocity()).norm()});
    for (int i = 0; i < tree.dof(); ++i) {
      worst_com = std::max(worst_com, (J.col(6 + i) - peer.com_jacobian_column(i)).norm());
    }
  }
  std::printf("%s: torque %.1e, wrench %.1e (of their size), CoM %.1e\n", tree.name().c_str(),
              worst_torque, worst_wrench, worst_com);
  EXPECT_LT(worst_torque, 1e-9);
  EXPECT_LT(worst_wrench, 1e-9);
  EXPECT_LT(worst_com, 1e-9);
}

TEST(DynamicsAgainstDart, Biped) {
  compare(std::string(MIMESIS_SOURCE_DIR) + "/models/biped.urdf");
}

TEST(DynamicsAgainstDart, Jvrc1) {
  const auto urdf = shared_data("data/robots/jvrc1.urdf");
  if (!std::filesystem::exists(urdf)) GTEST_SKIP() << "not here: " << urdf << " is absent";
  compare(urdf.string());
}

}  // namespace
}  // namespace mimesis::robot
