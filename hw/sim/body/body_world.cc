#include "hw/sim/body/body_world.h"

#include <algorithm>
#include <cmath>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/DegreeOfFreedom.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/simulation/World.hpp>
#include <limits>

#include "common/error.h"
#include "common/math/so3.h"
#include "hw/sim/body/collision_shapes.h"
#include "hw/sim/body/dart_body.h"
#include "hw/sim/body/walk_judge.h"

namespace mimesis::hw::sim {
namespace {

constexpr double kObject_m = 0.03;  ///< radius of the object in the hand: a ball

}  // namespace

Eigen::Matrix3d ground_rotation(const Eigen::Vector2d& slope_rad) {
  return (Eigen::AngleAxisd(slope_rad.x(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(slope_rad.y(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

double ground_height_m(const Eigen::Vector2d& slope_rad, const Eigen::Vector2d& p_W_m) {
  const Eigen::Vector3d up_W = ground_rotation(slope_rad).col(2);
  return -up_W.head<2>().dot(p_W_m) / up_W.z();
}

struct BodyWorld::Impl {
  struct RunningPush {
    LinkForce force;
    long first_step, last_step;  ///< steps of the world, the last one excluded
  };

  Impl(const robot::Biped& robot, const std::string& file, const BodyOptions& wanted)
      : biped(robot),
        options(wanted),
        body(make_dart_body(biped, options)),
        obstacles(biped, file, options.drawer, body),
        motors(biped, body, options),
        loads(biped, options.payload_kg, options.dt_s),
        errors(options.senses, options.seed),
        fall(biped, body.R_WG.col(2)) {
    const int dof = biped.tree.dof();
    set_point = goal = biped.half_sitting;
    start = between = set_point;
    sensors.q = sensors.dq = sensors.torque = Eigen::VectorXd::Zero(dof);
    sensors.specific_force_I = Eigen::Vector3d(0.0, 0.0, robot::kGravity);
    sense(Eigen::Vector3d::Zero(), body.X_WL(biped.imu).linear(), 0.0);
    observe();
  }

  void take_target(std::span<const double> target);
  void advance(long steps);
  void force(long step);
  void sense(const Eigen::Vector3d& v_before_W, const Eigen::Matrix3d& R_WI_before,
             double duration_s);
  void observe();
  void judge_fall();
  void soles(std::array<Eigen::Isometry3d, 2>& X_WS) const;

  const robot::Biped biped;
  const BodyOptions options;
  DartBody body;
  CollisionShapes obstacles;
  Motors motors;
  JointLoads loads;
  SensorErrors errors;
  FallJudge fall;
  Eigen::VectorXd start, goal, set_point, between;  ///< dof [rad]
  std::vector<RunningPush> pushes;
  std::vector<LinkForce> pulls, forces;  ///< forces: all that act in this step
  std::vector<ContactForce> contacts;    ///< beside those of feet, in this step
  bool carries = false;                  ///< the object
  long done = 0;                         ///< steps of the world
  bool diverged = false;  ///< numbers that are none: the world stands still from then on
  BodySensors sensors;
  BodyTruth truth;
  std::string trouble;
};

void BodyWorld::Impl::take_target(std::span<const double> target) {
  goal = set_point;
  if (target.size() != static_cast<std::size_t>(goal.size())) {
    trouble = "target: " + std::to_string(target.size()) + " values, expected " +
              std::to_string(goal.size()) + ": all set-points are held";
    return;
  }
  for (std::size_t i = 0; i < target.size(); ++i) {
    const robot::Link& link = biped.tree.moved(static_cast<int>(i));
    if (!std::isfinite(target[i])) {
      trouble = "target of joint '" + link.joint + "': " + std::to_string(target[i]) +
                ", expected a number: its set-point is held";
      continue;
    }
    goal[static_cast<Eigen::Index>(i)] = std::clamp(target[i], link.lower, link.upper);
  }
}

void BodyWorld::Impl::force(long step) {
  forces = pulls;
  for (const RunningPush& push : pushes) {
    if (step >= push.first_step && step < push.last_step) forces.push_back(push.force);
  }
  for (const LinkForce& force : forces) {
    const DartLink& link = body.at(force.link);
    link.node->addExtForce(force.force_W_n, link.X_NL * force.point_L_m, false, true);
  }
}

void BodyWorld::Impl::soles(std::array<Eigen::Isometry3d, 2>& X_WS) const {
  for (const robot::Side side : robot::kSides) X_WS[side] = body.X_WL(biped.leg[side].sole);
}

void BodyWorld::Impl::advance(long steps) {
  start = set_point;
  sensors.torque.setZero();
  sensors.foot_S.fill({});
  truth.most_normal_n = 0.0;
  GroundContact sum;
  for (long i = 1; i <= steps; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(steps);
    between = start + share * (goal - start);
    motors.drive(between);
    force(done);
    soles(truth.X_WS);
    obstacles.move(share, static_cast<double>(steps) * options.dt_s);
    loads.before(body);
    body.world->step();
    ++done;
    const GroundContact now = read_contacts(body, biped, truth.X_WS);
    obstacles.read(contacts);
    const Eigen::VectorXd& torque = loads.after(body, now, truth.X_WS, forces, contacts);
    motors.feel(torque);
    sensors.torque += torque;
    for (const robot::Side side : robot::kSides) {
      sensors.foot_S[side].force += now.foot_S[side].force;
      sensors.foot_S[side].moment += now.foot_S[side].moment;
    }
    sum.weighted_W += now.weighted_W;
    sum.vertical_n += now.vertical_n;
    truth.most_normal_n =
        std::max(truth.most_normal_n, now.foot_S[0].force.z() + now.foot_S[1].force.z());
  }
  obstacles.arrive();
  truth.self = obstacles.self();
  truth.furniture = obstacles.furniture();
  set_point = goal;
  const double n = static_cast<double>(steps);
  sensors.torque /= n;
  for (robot::Wrench& wrench : sensors.foot_S) {
    wrench.force /= n;
    wrench.moment /= n;
  }
  if (sum.vertical_n > 1e-9) truth.zmp_W_m = sum.weighted_W / sum.vertical_n;
  for (const robot::Side side : robot::kSides) {
    const robot::Wrench& wrench = sensors.foot_S[side];
    truth.normal_n[side] = wrench.force.z();
    truth.ankle_pitch_n_m[side] =
        (wrench.moment - biped.leg[side].ankle_S_m.cross(wrench.force)).y();
  }
}

void BodyWorld::Impl::sense(const Eigen::Vector3d& v_before_W, const Eigen::Matrix3d& R_WI_before,
                            double duration_s) {
  for (std::size_t i = 0; i < body.dof.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    sensors.q[k] = options.senses.motor_encoders ? motors.position(i) : body.dof[i]->getPosition();
    sensors.dq[k] = options.senses.motor_encoders ? motors.speed(i) : body.dof[i]->getVelocity();
  }
  const Eigen::Matrix3d R_WI = body.X_WL(biped.imu).linear();
  sensors.R_WI = Eigen::Quaterniond(R_WI);
  Eigen::Vector3d felt_W(0.0, 0.0, robot::kGravity);
  sensors.gyro_I.setZero();
  if (duration_s > 0.0) {
    sensors.gyro_I = math::log_so3(R_WI_before.transpose() * R_WI) / duration_s;
    felt_W += (body.velocity(biped.imu) - v_before_W) / duration_s;
  }
  sensors.specific_force_I = R_WI.transpose() * felt_W;
  errors.spoil(static_cast<double>(done) * options.dt_s, sensors);
}

void BodyWorld::Impl::observe() {
  truth.time_s = static_cast<double>(done) * options.dt_s;
  truth.X_WB = body.X_WB();
  soles(truth.X_WS);
  for (const robot::Side side : robot::kSides) {
    truth.hand_W_m[side] = biped.hand[side] < 0 ? Eigen::Vector3d::Zero().eval()
                                                : body.X_WL(biped.hand[side]).translation();
  }
  if (biped.head >= 0) truth.X_WH = body.X_WL(biped.head);
  truth.com_W_m = body.robot->getCOM();
  truth.com_v_W = body.robot->getCOMLinearVelocity();
  if (done == 0) truth.zmp_W_m = truth.com_W_m.head<2>();
  judge_fall();
}

void BodyWorld::Impl::judge_fall() {
  if (!truth.com_W_m.allFinite() || !sensors.q.allFinite()) {
    diverged = true;
    truth.fell = true;
    truth.how = "the physics gave no numbers at " + std::to_string(truth.time_s) + " s";
    return;
  }
  if (truth.fell) return;
  const bool left =
      sensors.foot_S[robot::kLeft].force.z() >= sensors.foot_S[robot::kRight].force.z();
  truth.how = fall.how(truth.com_W_m, body.X_WL(biped.trunk).linear(), set_point,
                       left ? robot::kLeft : robot::kRight);
  truth.fell = !truth.how.empty();
}

BodyWorld::BodyWorld(const robot::Biped& biped, const std::string& urdf_file,
                     const BodyOptions& options)
    : impl_(std::make_unique<Impl>(biped, urdf_file, options)) {}

BodyWorld::~BodyWorld() = default;

void BodyWorld::step(std::span<const double> target, double duration_s) {
  Impl& my = *impl_;
  if (my.diverged) return;
  const long steps = std::max(1L, std::lround(duration_s / my.options.dt_s));
  my.take_target(target);
  const Eigen::Vector3d v_before = my.body.velocity(my.biped.imu);
  const Eigen::Matrix3d R_before = my.body.X_WL(my.biped.imu).linear();
  my.advance(steps);
  my.sense(v_before, R_before, static_cast<double>(steps) * my.options.dt_s);
  my.observe();
}

void BodyWorld::push(const Push& push) {
  Impl& my = *impl_;
  const int link = push.link.empty() ? my.biped.trunk : my.biped.tree.require_link(push.link);
  if (!push.impulse_W_ns.allFinite() || !std::isfinite(push.at_s) ||
      !std::isfinite(push.duration_s)) {
    my.trouble = "push: not finite, expected numbers: not pushed";
    return;
  }
  const double dt = my.options.dt_s;
  const long first = std::max(my.done, std::lround(push.at_s / dt));
  const long steps = std::max(1L, std::lround(push.duration_s / dt));
  const Eigen::Vector3d force = push.impulse_W_ns / (static_cast<double>(steps) * dt);
  my.pushes.push_back(
      {{link, my.biped.tree.link(link).inertia.com_m, force}, first, first + steps});
}

void BodyWorld::fail(int joint, MotorFault fault) { impl_->motors.fail(joint, fault); }

void BodyWorld::pull(int link, const Eigen::Vector3d& point_L_m, const Eigen::Vector3d& force_W_n) {
  Impl& my = *impl_;
  MIMESIS_ASSERT(link >= 0 && point_L_m.allFinite() && force_W_n.allFinite());
  for (LinkForce& pull : my.pulls) {
    if (pull.link != link) continue;
    pull = {link, point_L_m, force_W_n};
    return;
  }
  my.pulls.push_back({link, point_L_m, force_W_n});
}

void BodyWorld::move(Drawer& drawer, const std::array<bool, 2>& grips, double duration_s) {
  Impl& my = *impl_;
  MIMESIS_ASSERT(my.options.drawer.has_value());
  const Eigen::Vector3d force_W_n =
      drawer.step(my.truth.time_s, duration_s, {my.truth.hand_W_m, grips});
  pull(my.biped.hand[robot::kLeft], Eigen::Vector3d::Zero(), force_W_n);
  my.obstacles.aim(drawer.now());
  if (!drawer.now().taken || my.carries) return;
  my.carries = true;
  const double mass = my.options.drawer->object_kg;
  if (mass <= 0.0) return;
  const robot::Inertia object{
      .mass_kg = mass,
      .com_m = Eigen::Vector3d::Zero(),
      .about_com_kg_m2 = 0.4 * mass * kObject_m * kObject_m * Eigen::Matrix3d::Identity()};
  carry(my.body, my.biped.hand[robot::kRight], object);
  my.loads.carry(my.biped.hand[robot::kRight], object);
}

const BodySensors& BodyWorld::sensors() const { return impl_->sensors; }
const BodyTruth& BodyWorld::truth() const { return impl_->truth; }
double BodyWorld::time_s() const { return impl_->truth.time_s; }
const std::string& BodyWorld::trouble() const { return impl_->trouble; }

namespace {

// Figures of the plants [docs/walking.md 7.3]. The damping is small because DART's contact impulses
// do not know the springs: a strong damper would make loaded joints soft [docs/walking.md 7.2].
constexpr double kStrong_n_m_rad = 6000.0;  ///< legs and trunk
constexpr double kAnkleBush_n_m_rad = 1500.0;
constexpr double kDamping_s = 0.003;  ///< share of the stiffness
/// Less damping for what is lighter: the foot of G1 (4e-4) gave way by 60 mrad under 4 N m
/// [docs/walking.md 7.2].
constexpr double kLightFoot_kg_m2 = 6.5e-3;

/// Between the root and the trunk: bears the upper body.
bool bears_trunk(const robot::Biped& biped, int joint) {
  const auto& tree = biped.tree;
  return tree.carries(tree.moved_link(joint), biped.trunk);
}

bool in_leg(const robot::Biped& biped, int joint) {
  return std::any_of(biped.leg.begin(), biped.leg.end(), [&](const robot::Biped::Leg& leg) {
    return std::find(leg.dof.begin(), leg.dof.end(), joint) != leg.dof.end();
  });
}

bool in_ankle(const robot::Biped& biped, int joint) {
  return std::any_of(biped.leg.begin(), biped.leg.end(), [&](const robot::Biped::Leg& leg) {
    return leg.dof[robot::kAnkleFirst] == joint || leg.dof[robot::kAnkleLast] == joint;
  });
}

bool pitches_ankle(const robot::Biped& biped, int joint) {
  return in_ankle(biped, joint) && std::abs(biped.tree.moved(joint).axis.y()) > 0.5;
}

bool in_knee(const robot::Biped& biped, int joint) {
  return std::any_of(biped.leg.begin(), biped.leg.end(),
                     [&](const robot::Biped::Leg& leg) { return leg.dof[robot::kKnee] == joint; });
}

/// Inertia about the joint's axis of all that it carries, half-sitting [kg m²].
double inertia_beyond(const robot::Biped& biped, const robot::Kinematics& kinematics, int joint) {
  const robot::RobotTree& tree = biped.tree;
  const int moved = tree.moved_link(joint);
  const Eigen::Isometry3d& X = kinematics.X_WL(moved);
  const Eigen::Vector3d axis = X.linear() * tree.link(moved).axis;
  double sum = 0.0;
  for (int l = moved; l < static_cast<int>(tree.links().size()); ++l) {
    if (!tree.carries(moved, l)) continue;
    const robot::Inertia& own = tree.link(l).inertia;
    const Eigen::Isometry3d& X_L = kinematics.X_WL(l);
    const Eigen::Vector3d axis_L = X_L.linear().transpose() * axis;
    sum += own.mass_kg * axis.cross(X_L * own.com_m - X.translation()).squaredNorm() +
           axis_L.dot(own.about_com_kg_m2 * axis_L);
  }
  return sum;
}

/// A URDF that says nothing about a motor does not limit it.
double or_infinite(double limit) {
  return limit > 0.0 ? limit : std::numeric_limits<double>::infinity();
}

}  // namespace

std::vector<MotorModel> motor_models(const robot::Biped& biped, const BodyOptions& options) {
  std::vector<MotorModel> motors(static_cast<std::size_t>(biped.tree.dof()));
  robot::Kinematics kinematics(biped.tree);
  kinematics.update(biped.X_WB_half_sitting, biped.half_sitting);
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const int joint = static_cast<int>(i);
    const robot::Link& link = biped.tree.moved(joint);
    MotorModel& motor = motors[i];
    const bool strong = in_leg(biped, joint) || bears_trunk(biped, joint);
    const bool bush = options.plant == Plant::servo && in_ankle(biped, joint);
    const bool knee = in_knee(biped, joint) && !options.rigid_knees;
    motor.servo = options.plant == Plant::servo && strong && !bush && !knee;
    motor.stiffness_n_m_rad =
        bush ? kAnkleBush_n_m_rad : (strong ? kStrong_n_m_rad : options.arm_stiffness_n_m_rad);
    motor.damping_n_m_s_rad = kDamping_s * motor.stiffness_n_m_rad;
    if (in_leg(biped, joint)) {
      motor.damping_n_m_s_rad *=
          std::min(1.0, inertia_beyond(biped, kinematics, joint) / kLightFoot_kg_m2);
    }
    motor.speed_rad_s = options.motor_speed_share * or_infinite(link.max_speed);
    motor.torque_n_m = options.motor_torque_share * or_infinite(link.max_effort);
    if (options.ankle_pitch_n_m > 0.0 && pitches_ankle(biped, joint)) {
      motor.torque_n_m = std::min(motor.torque_n_m, options.ankle_pitch_n_m);
    }
    motor.lower_rad = link.lower;
    motor.upper_rad = link.upper;
  }
  return motors;
}

}  // namespace mimesis::hw::sim
