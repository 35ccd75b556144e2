#include "hw/sim/body/dart_body.h"

#include <algorithm>
#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/CollisionResult.hpp>
#include <dart/collision/dart/DARTCollisionDetector.hpp>
#include <dart/constraint/ConstraintSolver.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/DegreeOfFreedom.hpp>
#include <dart/dynamics/FreeJoint.hpp>
#include <dart/dynamics/Joint.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/ShapeNode.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/simulation/World.hpp>
#include <limits>

#include "common/error.h"
#include "hw/sim/body/body_world.h"

namespace mimesis::hw::sim {
namespace {

using dart::dynamics::BodyNode;
using dart::dynamics::Skeleton;
using dart::dynamics::SkeletonPtr;

constexpr double kGroundHalf_m = 50.0, kGroundDepth_m = 1.0;
constexpr double kSoleThickness_m = 0.04;

/// The robot: a body for the root and for every link that a joint moves, with what is fixed to it.
/// Masses of fixed links are in `biped` with the links that carry them (robot::merged), and frames
/// are none of DART's bodies, which would move them through every impulse.
void add_robot(const robot::RobotTree& tree, DartBody& body) {
  using dart::dynamics::FreeJoint, dart::dynamics::PrismaticJoint, dart::dynamics::RevoluteJoint;
  body.robot = Skeleton::create(tree.name());
  for (const robot::Link& link : tree.links()) {  // parents come first
    if (link.parent >= 0 && link.dof < 0) {
      const DartLink& parent = body.at(link.parent);
      body.link.push_back({parent.node, parent.X_NL * link.X_PJ});
      continue;
    }
    BodyNode::Properties node;
    node.mName = link.name;
    node.mInertia = dart::dynamics::Inertia(link.inertia.mass_kg, link.inertia.com_m,
                                            link.inertia.about_com_kg_m2);
    if (link.parent < 0) {
      FreeJoint::Properties root;
      root.mName = "rootJoint";
      auto [joint, own] = body.robot->createJointAndBodyNodePair<FreeJoint>(nullptr, root, node);
      body.link.push_back({own});
      continue;
    }
    const DartLink& parent = body.at(link.parent);
    const auto add = [&]<class Joint>(Joint*) {
      typename Joint::Properties joint;
      joint.mName = link.joint;
      joint.mT_ParentBodyToJoint = parent.X_NL * link.X_PJ;
      joint.mAxis = link.axis;
      return body.robot->createJointAndBodyNodePair<Joint>(parent.node, joint, node).second;
    };
    BodyNode* own = link.type == robot::JointType::prismatic
                        ? add(static_cast<PrismaticJoint*>(nullptr))
                        : add(static_cast<RevoluteJoint*>(nullptr));
    body.link.push_back({own});
    body.dof.push_back(own->getParentJoint()->getDof(0));
  }
}

void add_box(BodyNode& body, const Eigen::Vector3d& size_m, const Eigen::Isometry3d& X_LB,
             double friction) {
  auto* node =
      body.createShapeNodeWith<dart::dynamics::CollisionAspect, dart::dynamics::DynamicsAspect>(
          std::make_shared<dart::dynamics::BoxShape>(size_m));
  node->setRelativeTransform(X_LB);
  node->getDynamicsAspect()->setFrictionCoeff(friction);
}

void add_soles(const robot::Biped& biped, double friction, DartBody& body) {
  for (const robot::Biped::Leg& leg : biped.leg) {
    const Eigen::Isometry3d X_NS =
        body.at(leg.foot).node->getWorldTransform().inverse() * body.X_WL(leg.sole);
    Eigen::Vector3d size, middle;
    size << leg.max_S_m - leg.min_S_m, kSoleThickness_m;
    middle << 0.5 * (leg.min_S_m + leg.max_S_m), 0.5 * kSoleThickness_m;
    add_box(*body.at(leg.foot).node, size, X_NS * Eigen::Translation3d(middle), friction);
  }
}

/// Ground and plates: boxes that are fixed in W.
void add_ground(const BodyOptions& options, DartBody& body) {
  const SkeletonPtr ground = Skeleton::create("ground");
  BodyNode& node = *ground->createJointAndBodyNodePair<dart::dynamics::WeldJoint>().second;
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  X_WG.linear() = body.R_WG;
  add_box(node, {2.0 * kGroundHalf_m, 2.0 * kGroundHalf_m, kGroundDepth_m},
          X_WG * Eigen::Translation3d(0.0, 0.0, -0.5 * kGroundDepth_m), options.friction);
  for (const Plate& plate : options.plates) {
    const Eigen::Vector3d size(2.0 * plate.half_m.x(), 2.0 * plate.half_m.y(), plate.height_m);
    add_box(node, size,
            X_WG * Eigen::Translation3d(plate.center_W_m.x(), plate.center_W_m.y(),
                                        0.5 * plate.height_m),
            options.friction);
  }
  ground->setMobile(false);
  body.world->addSkeleton(ground);
}

bool overlaps(const Plate& plate, const Eigen::Vector2d& low, const Eigen::Vector2d& high) {
  return ((plate.center_W_m - plate.half_m).array() < high.array()).all() &&
         ((plate.center_W_m + plate.half_m).array() > low.array()).all();
}

/// Half-sitting, square on the ground, on top of the highest plate below a sole.
void place(const robot::Biped& biped, const BodyOptions& options, DartBody& body) {
  for (std::size_t i = 0; i < body.dof.size(); ++i) {
    body.dof[i]->setPosition(biped.half_sitting[static_cast<Eigen::Index>(i)]);
  }
  auto* root = static_cast<dart::dynamics::FreeJoint*>(body.robot->getJoint(0));
  root->setTransform(biped.X_WB_half_sitting);
  double height = 0.0;
  for (const robot::Biped::Leg& leg : biped.leg) {
    const Eigen::Vector2d sole = body.X_WL(leg.sole).translation().head<2>();
    for (const Plate& plate : options.plates) {
      if (overlaps(plate, sole + leg.min_S_m, sole + leg.max_S_m)) {
        height = std::max(height, plate.height_m);
      }
    }
  }
  Eigen::Isometry3d X_WG = Eigen::Isometry3d::Identity();
  X_WG.linear() = body.R_WG;
  root->setTransform(X_WG * Eigen::Translation3d(0.0, 0.0, height) * biped.X_WB_half_sitting);
}

const dart::dynamics::BodyNode* body_of(const dart::collision::CollisionObject* object) {
  const auto* node = object->getShapeFrame()->asShapeNode();
  return node != nullptr ? node->getBodyNodePtr().get() : nullptr;
}

robot::RobotTree with_payload(const robot::Biped& biped, double payload_kg) {
  std::vector<robot::Link> links = biped.tree.links();
  links[static_cast<std::size_t>(biped.trunk)].inertia.mass_kg += payload_kg;
  return {biped.tree.name(), std::move(links)};
}

constexpr double kWeak = 0.2;  ///< share of its torque
constexpr double kInfinite = std::numeric_limits<double>::infinity();

}  // namespace

Eigen::Isometry3d DartBody::X_WL(int index) const {
  return at(index).node->getWorldTransform() * at(index).X_NL;
}

Eigen::Vector3d DartBody::velocity(int index) const {
  return at(index).node->getLinearVelocity(at(index).X_NL.translation());
}

Eigen::Isometry3d DartBody::X_WB() const { return robot->getBodyNode(0)->getWorldTransform(); }

DartBody make_dart_body(const robot::Biped& biped, const BodyOptions& options) {
  for (const Plate& plate : options.plates) {
    if (plate.height_m > 0.0) continue;
    throw ConfigError("simulated body: a plate has no size, expected half_m and height_m above 0");
  }
  DartBody body;
  add_robot(biped.tree, body);
  body.R_WG = ground_rotation(options.slope_rad);
  BodyNode& trunk = *body.at(biped.trunk).node;
  trunk.setMass(trunk.getMass() + options.payload_kg);
  body.robot->disableSelfCollisionCheck();

  body.world = dart::simulation::World::create();
  body.world->setTimeStep(options.dt_s);
  body.world->setGravity(Eigen::Vector3d(0.0, 0.0, -robot::kGravity));
  // the one that gives four corners of a box on a box, and the fastest [docs/walking.md 7.1]
  body.world->getConstraintSolver()->setCollisionDetector(
      dart::collision::DARTCollisionDetector::create());
  place(biped, options, body);
  add_soles(biped, options.friction, body);
  add_ground(options, body);
  body.world->addSkeleton(body.robot);
  return body;
}

void carry(DartBody& body, int link, const robot::Inertia& load) {
  const DartLink& at = body.at(link);
  const dart::dynamics::Inertia& own = at.node->getInertia();
  const double mass = own.getMass() + load.mass_kg;
  const Eigen::Vector3d load_N = at.X_NL * load.com_m;
  const Eigen::Vector3d com = (own.getMass() * own.getLocalCOM() + load.mass_kg * load_N) / mass;
  const auto from = [&](double m, const Eigen::Vector3d& p) -> Eigen::Matrix3d {
    const Eigen::Vector3d d = p - com;
    return m * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  };
  const Eigen::Matrix3d R = at.X_NL.linear();
  const Eigen::Matrix3d moment = own.getMoment() + from(own.getMass(), own.getLocalCOM()) +
                                 R * load.about_com_kg_m2 * R.transpose() +
                                 from(load.mass_kg, load_N);
  at.node->setInertia(dart::dynamics::Inertia(mass, com, moment));
}

GroundContact read_contacts(const DartBody& body, const robot::Biped& biped,
                            const std::array<Eigen::Isometry3d, 2>& X_WS) {
  GroundContact out;
  for (const auto& contact : body.world->getLastCollisionResult().getContacts()) {
    const auto* first = body_of(contact.collisionObject1);
    const auto* second = body_of(contact.collisionObject2);
    for (const robot::Side side : robot::kSides) {
      const auto* foot = body.at(biped.leg[side].foot).node;
      if (first != foot && second != foot) continue;
      const Eigen::Vector3d force_W = first == foot ? contact.force : -contact.force;
      const Eigen::Vector3d force_S = X_WS[side].linear().transpose() * force_W;
      out.foot_S[side].force += force_S;
      out.foot_S[side].moment += (X_WS[side].inverse() * contact.point).cross(force_S);
      out.weighted_W += contact.point.head<2>() * force_W.z();
      out.vertical_n += force_W.z();
    }
  }
  return out;
}

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
                                         const std::vector<LinkForce>& forces,
                                         const std::vector<ContactForce>& contacts) {
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
  for (const ContactForce& contact : contacts) {
    take_off(contact.link, contact.p_W_m, contact.force_W_n, Eigen::Vector3d::Zero());
  }
  return torque_;
}

void JointLoads::carry(int link, const robot::Inertia& load) {
  std::vector<robot::Link> links = loaded_.links();
  MIMESIS_ASSERT(links[static_cast<std::size_t>(link)].inertia.mass_kg == 0.0);
  links[static_cast<std::size_t>(link)].inertia = load;
  loaded_ = robot::RobotTree(loaded_.name(), std::move(links));
  dynamics_ = robot::Dynamics(loaded_);
}

void JointLoads::take_off(int link, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& force_W,
                          const Eigen::Vector3d& moment_W) {
  if (force_W.isZero(0.0) && moment_W.isZero(0.0)) return;
  kinematics_.jacobian(link, p_W_m, jacobian_);
  torque_.noalias() -= jacobian_.topRows<3>().rightCols(torque_.size()).transpose() * force_W;
  torque_.noalias() -= jacobian_.bottomRows<3>().rightCols(torque_.size()).transpose() * moment_W;
}

Motors::Motors(const robot::Biped& biped, const DartBody& body, const BodyOptions& options)
    : dt_s_(options.dt_s), motors_(body.dof.size()) {
  const std::vector<MotorModel> models = motor_models(biped, options);
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    Motor& motor = motors_[i];
    const MotorModel& model = models[i];
    motor.dof = body.dof[i];
    motor.servo = model.servo;
    motor.stiffness_n_m_rad = model.stiffness_n_m_rad;
    motor.damping_n_m_s_rad = model.damping_n_m_s_rad;
    motor.speed_rad_s = model.speed_rad_s;
    motor.torque_n_m = model.torque_n_m;
    motor.lower_rad = model.lower_rad;
    motor.upper_rad = model.upper_rad;
    motor.wanted_rad = motor.at_rad = motor.before_rad = motor.dof->getPosition();
    set_up(motor);
  }
}

void Motors::set_up(Motor& motor) {
  using dart::dynamics::Joint;
  Joint& joint = *motor.dof->getJoint();
  const bool servo = motor.servo && !motor.off;
  const bool spring = !motor.servo && !motor.off;
  joint.setActuatorType(servo ? Joint::SERVO : Joint::FORCE);
  joint.setLimitEnforcement(true);
  motor.dof->setPositionLimits(motor.lower_rad, motor.upper_rad);
  motor.dof->setVelocityLimits(-kInfinite, kInfinite);  // the ramp of the set-point limits it
  motor.dof->setForceLimits(-motor.torque_n_m, motor.torque_n_m);
  motor.dof->setSpringStiffness(spring ? motor.stiffness_n_m_rad : 0.0);
  motor.dof->setDampingCoefficient(spring ? motor.damping_n_m_s_rad : 0.0);
  motor.dof->setCommand(0.0);
}

void Motors::fail(int joint, MotorFault fault) {
  Motor& motor = motors_[static_cast<std::size_t>(joint)];
  if (fault == MotorFault::off) motor.off = true;
  if (fault == MotorFault::weak) motor.torque_n_m *= kWeak;
  if (fault == MotorFault::locked) {
    motor.locked = true;
    motor.wanted_rad = motor.dof->getPosition();
    motor.torque_n_m = kInfinite;
  }
  set_up(motor);
}

void Motors::drive(Motor& motor, double set_point) {
  if (motor.off) return;
  const double most = motor.speed_rad_s * dt_s_;
  if (!motor.locked) {
    motor.wanted_rad = std::clamp(set_point, motor.wanted_rad - most, motor.wanted_rad + most);
  }
  const double q = motor.dof->getPosition();
  if (motor.servo) {
    motor.dof->setCommand(
        std::clamp(kServoGain_1_s * (motor.wanted_rad - q), -motor.speed_rad_s, motor.speed_rad_s));
    return;
  }
  const double most_rad = motor.torque_n_m / motor.stiffness_n_m_rad;
  const double beyond_rad = motor.beyond_spring_n_m / motor.stiffness_n_m_rad;
  motor.stretch_rad =
      std::clamp(motor.wanted_rad - q, -most_rad - beyond_rad, most_rad - beyond_rad);
  motor.before_rad = motor.at_rad;
  motor.at_rad = q + motor.stretch_rad;
  motor.dof->setRestPosition(motor.at_rad);
}

void Motors::drive(const Eigen::VectorXd& set_point) {
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    drive(motors_[i], set_point[static_cast<Eigen::Index>(i)]);
  }
}

void Motors::feel(const Eigen::VectorXd& torque) {
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    Motor& motor = motors_[i];
    if (motor.servo || motor.off) continue;
    motor.beyond_spring_n_m =
        torque[static_cast<Eigen::Index>(i)] - motor.stiffness_n_m_rad * motor.stretch_rad;
  }
}

double Motors::position(std::size_t joint) const {
  const Motor& motor = motors_[joint];
  return motor.servo || motor.off ? motor.dof->getPosition() : motor.at_rad;
}

double Motors::speed(std::size_t joint) const {
  const Motor& motor = motors_[joint];
  return motor.servo || motor.off ? motor.dof->getVelocity()
                                  : (motor.at_rad - motor.before_rad) / dt_s_;
}

}  // namespace mimesis::hw::sim
