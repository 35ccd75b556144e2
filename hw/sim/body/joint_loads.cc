#include "hw/sim/body/joint_loads.h"

#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/DegreeOfFreedom.hpp>
#include <dart/dynamics/Skeleton.hpp>

namespace mimesis::hw::sim {

namespace {

robot::RobotTree with_payload(const robot::Biped& biped, double payload_kg) {
  std::vector<robot::Link> links = biped.tree.links();
  links[static_cast<std::size_t>(biped.trunk)].inertia.mass_kg += payload_kg;
  return {biped.tree.name(), std::move(links)};
}

}  // namespace

JointLoads::JointLoads(const robot::Biped& biped, double payload_kg, double dt_s)
    : biped_(&biped),
      loaded_(with_payload(biped, payload_kg)),
      dt_s_(dt_s),
      kinematics_(loaded_),
      dynamics_(loaded_),
      motion_(biped.tree.dof()),
      jacobian_(6, 6 + biped.tree.dof()),
      torque_(Eigen::VectorXd::Zero(biped.tree.dof())) {}

void JointLoads::before(const DartBody& body) {
  for (std::size_t i = 0; i < body.dof.size(); ++i) {
    motion_.q[static_cast<Eigen::Index>(i)] = body.dof[i]->getPosition();
    motion_.dq[static_cast<Eigen::Index>(i)] = body.dof[i]->getVelocity();
  }
  const Eigen::Vector6d& twist_B = body.robot->getBodyNode(0)->getSpatialVelocity();
  omega_B_ = twist_B.head<3>();
  v_B_ = twist_B.tail<3>();
  motion_.X_WB = body.X_WB();
}

const Eigen::VectorXd& JointLoads::after(const DartBody& body, const GroundContact& ground,
                                         const std::array<Eigen::Isometry3d, 2>& X_WS,
                                         const std::vector<LinkForce>& forces) {
  for (std::size_t i = 0; i < body.dof.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    motion_.ddq[k] = (body.dof[i]->getVelocity() - motion_.dq[k]) / dt_s_;
  }
  // DART moves the twist of the base in the base's own frame
  const Eigen::Vector6d& twist_B = body.robot->getBodyNode(0)->getSpatialVelocity();
  const Eigen::Matrix3d R_WB = motion_.X_WB.linear();
  motion_.v_W = R_WB * v_B_;
  motion_.omega_W = R_WB * omega_B_;
  motion_.a_W = R_WB * ((twist_B.tail<3>() - v_B_) / dt_s_ + omega_B_.cross(v_B_));
  motion_.alpha_W = R_WB * (twist_B.head<3>() - omega_B_) / dt_s_;
  dynamics_.inverse_dynamics(motion_, torque_);

  kinematics_.update(motion_.X_WB, motion_.q);
  for (const robot::Side side : robot::kSides) {
    const Eigen::Matrix3d& R_WS = X_WS[side].linear();
    take_off(biped_->leg[side].foot, X_WS[side].translation(), R_WS * ground.foot_S[side].force,
             R_WS * ground.foot_S[side].moment);
  }
  for (const LinkForce& force : forces) {
    take_off(force.link, kinematics_.X_WL(force.link) * force.point_L_m, force.force_W_n,
             Eigen::Vector3d::Zero());
  }
  return torque_;
}

void JointLoads::take_off(int link, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& force_W,
                          const Eigen::Vector3d& moment_W) {
  if (force_W.isZero(0.0) && moment_W.isZero(0.0)) return;
  kinematics_.jacobian(link, p_W_m, jacobian_);
  torque_.noalias() -= jacobian_.topRows<3>().rightCols(torque_.size()).transpose() * force_W;
  torque_.noalias() -= jacobian_.bottomRows<3>().rightCols(torque_.size()).transpose() * moment_W;
}

}  // namespace mimesis::hw::sim
