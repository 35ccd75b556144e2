#include "experiments/walk/study/naive.h"

#include <cmath>
#include <deque>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/math/so3.h"
#include "common/robot/kinematics.h"
#include "experiments/walk/study/drawer_study.h"
#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/character/smooth.h"
#include "nodes/synthesizer/sequence/action_course.h"
#include "nodes/walker/pattern/generators.h"
#include "nodes/walker/stabilizer/estimator.h"
#include "nodes/walker/stabilizer/stabilizer.h"

namespace mimesis::walk {
namespace {

using Eigen::Isometry3d, Eigen::Vector2d, Eigen::Vector3d;
using walker::kTick_s;

constexpr int kApart = 2;  // ticks on both sides of a difference
constexpr int kMean = 12;  // ticks on both sides of a mean

Isometry3d flat(const Isometry3d& X) {
  Isometry3d out = Isometry3d::Identity();
  out.translation() << X.translation().head<2>(), 0.0;
  out.linear() = Eigen::AngleAxisd(math::yaw_of(X.linear()), Vector3d::UnitZ()).toRotationMatrix();
  return out;
}

Isometry3d between(const Isometry3d& X, const Isometry3d& Y, double share_of_X) {
  Isometry3d out = Isometry3d::Identity();
  out.translation() = share_of_X * X.translation() + (1.0 - share_of_X) * Y.translation();
  out.linear() = Eigen::Quaterniond(Y.linear())
                     .slerp(share_of_X, Eigen::Quaterniond(X.linear()))
                     .toRotationMatrix();
  return out;
}

/// Turning of a moving frame between two instants, axis-angle.
Vector3d turned(const Isometry3d& before, const Isometry3d& after) {
  const Eigen::AngleAxisd turn(after.linear() * before.linear().transpose());
  return turn.angle() * turn.axis();
}

/// Poses of pelvis and soles of every tick.
std::vector<walker::StabilizerPlan> place(const robot::Biped& biped, const JointTrack& track) {
  robot::Kinematics kinematics(biped.tree);
  std::vector<walker::StabilizerPlan> out(track.q.size());
  std::array<Isometry3d, 2> X_WF;  // where feet stand
  kinematics.update(biped.X_WB_half_sitting, biped.half_sitting);
  for (const robot::Side s : robot::kSides) X_WF[s] = flat(kinematics.X_WL(biped.leg[s].sole));
  std::array<bool, 2> stood{true, true};
  Isometry3d X_WB = biped.X_WB_half_sitting;
  for (std::size_t k = 0; k < track.q.size(); ++k) {
    kinematics.update(Isometry3d::Identity(), track.q[k]);
    std::array<Isometry3d, 2> X_BS;
    for (const robot::Side s : robot::kSides) X_BS[s] = kinematics.X_WL(biped.leg[s].sole);
    walker::StabilizerPlan& p = out[k];
    p.pattern = track.plan[k];
    for (const robot::Side s : robot::kSides) {
      if (p.pattern.contact[s] && !stood[s]) X_WF[s] = flat(X_WB * X_BS[s]);
      stood[s] = p.pattern.contact[s];
    }
    X_WB = between(X_WF[0] * X_BS[0].inverse(), X_WF[1] * X_BS[1].inverse(),
                   walker::left_weight(p.pattern));
    p.X_WB_last = X_WB;
    for (const robot::Side s : robot::kSides) p.pattern.foot[s].X_WS = X_WB * X_BS[s];
    kinematics.update(X_WB, track.q[k]);
    p.com.p_W_m = kinematics.com().head<2>();
  }
  return out;
}

}  // namespace

std::vector<walker::StabilizerPlan> implied_reference(const robot::Biped& biped,
                                                      const JointTrack& track) {
  std::vector<walker::StabilizerPlan> out = place(biped, track);
  const auto n = static_cast<int>(out.size());
  const auto at = [&](int k) { return static_cast<std::size_t>(std::clamp(k, 0, n - 1)); };
  robot::Dynamics dynamics(biped.tree);
  robot::RobotMotion motion(biped.tree.dof());
  const double h = kApart * kTick_s;
  std::vector<Vector2d> zmp(out.size());
  for (int k = 0; k < n; ++k) {
    const std::size_t a = at(k - kApart), b = at(k), c = at(k + kApart);
    const Isometry3d &X = out[a].X_WB_last, &Y = out[b].X_WB_last, &Z = out[c].X_WB_last;
    const Vector3d &x = X.translation(), &y = Y.translation(), &z = Z.translation();
    motion.X_WB = Y;
    motion.v_W = (z - x) / (2.0 * h);
    motion.a_W = (z - 2.0 * y + x) / (h * h);
    const Vector3d to = turned(X, Y), from = turned(Y, Z);
    motion.omega_W = (to + from) / (2.0 * h);
    motion.alpha_W = (from - to) / (h * h);
    motion.q = track.q[b];
    motion.dq = (track.q[c] - track.q[a]) / (2.0 * h);
    motion.ddq = (track.q[c] - 2.0 * track.q[b] + track.q[a]) / (h * h);
    const robot::Wrench ground = dynamics.ground_wrench(motion);
    zmp[b] = ground.force.z() > 0.0 ? robot::zmp_of(ground) : out[b].com.p_W_m;
    out[b].com.v_W = (out[c].com.p_W_m - out[a].com.p_W_m) / (2.0 * h);
  }
  for (int k = 0; k < n; ++k) {
    Vector2d sum = Vector2d::Zero();
    for (int j = k - kMean; j <= k + kMean; ++j) sum += zmp[at(j)];
    walker::StabilizerPlan& p = out[at(k)];
    p.pattern.zmp_W_m = sum / (2 * kMean + 1);
    p.com.a_W = (out[at(k + kApart)].com.v_W - out[at(k - kApart)].com.v_W) / (2.0 * h);
    p.pattern.com = p.com;
  }
  return out;
}

namespace {

using synthesizer::MotionParameters;
using walker::kTick_s;

constexpr double kBeta = 0.2, kTakeOver_s = 0.4;

/// Plays the three actions at action and phase [0, 1].
class Player {
 public:
  Player(const synthesizer::ActionMaps& joints, const ActionParameters& actions)
      : joints_(joints), actions_(actions), mixed_(actions[0]) {}

  Eigen::VectorXd at(std::size_t action, double share) {
    const double window = kBeta * math::kTwoPi / 2.0;
    const double phase = std::min(share * math::kTwoPi, std::nextafter(math::kTwoPi, 0.0));
    const MotionParameters* p = &actions_[action];
    if (action > 0 && phase < window) {
      synthesizer::transition(actions_[action - 1], *p, 1, phase, kBeta, mixed_);
      p = &mixed_;
    } else if (action + 1 < actions_.size() && phase > math::kTwoPi - window) {
      synthesizer::transition(*p, actions_[action + 1], 1, phase - math::kTwoPi, kBeta, mixed_);
      p = &mixed_;
    }
    Eigen::VectorXd q(joints_.row_count());
    synthesizer::mixture_at(joints_.model().action[0], *p, phase, synthesizer::Between::cubic, q);
    return q;
  }

 private:
  const synthesizer::ActionMaps& joints_;
  const ActionParameters& actions_;
  MotionParameters mixed_;
};

}  // namespace

ActionParameters reconstructed(const synthesizer::ActionMaps& maps, std::size_t trial) {
  ActionParameters out;
  for (std::size_t a = 0; a < out.size(); ++a) {
    out[a] = synthesizer::parameters_of(maps.model().action[a].patterns.at(trial));
  }
  return out;
}

ActionParameters inferred(const synthesizer::ActionMaps& maps, const DrawerGoal& goal) {
  ActionParameters out;
  synthesizer::ActionTask task = goal.task();
  task.length_m = task.previous_length_m = goal.normal_m;
  out[0] = maps.at(synthesizer::kNormalStep, task);
  task.length_m = goal.reaching_m;
  out[1] = maps.at(synthesizer::kReachingStep, task);
  task.length_m = 0.0;
  task.duration_s = kStanding_s;
  task.previous_length_m = goal.reaching_m;
  out[2] = maps.at(synthesizer::kStanding, task);
  return out;
}

ActionRows mixed_rows(const synthesizer::ActionMaps& maps, const ActionParameters& actions) {
  ActionRows out;
  for (std::size_t a = 0; a < out.size(); ++a) {
    out[a] = synthesizer::mixture_rows(maps.model().action[a], actions[a]);
  }
  return out;
}

JointTrack track_of(const Recording& walk) {
  JointTrack out;
  for (const Recording::Tick& t : walk.ticks) {
    out.q.push_back(t.q);
    out.plan.push_back(t.plan);
  }
  return out;
}

JointTrack naive_track(const synthesizer::ActionMaps& joints, const ActionParameters& actions,
                       const Recording& walk) {
  JointTrack out = track_of(walk);
  const std::size_t from = walk.begin(1).value();
  MIMESIS_ASSERT(from >= 2);
  Player player(joints, actions);
  Eigen::VectorXd off, rate;
  for (std::size_t k = from; k < out.q.size(); ++k) {
    const Recording::Tick& t = walk.ticks[k];
    const Eigen::VectorXd q = player.at(static_cast<std::size_t>(t.number) - 1, t.phase);
    if (k == from) {
      const Recording::Tick& next = walk.ticks[k + 1];
      const Eigen::VectorXd soon = player.at(static_cast<std::size_t>(next.number) - 1, next.phase);
      off = out.q[k] - q;
      rate = (out.q[k] - out.q[k - 1] - (soon - q)) / kTick_s;
    }
    const double since_s = static_cast<double>(k - from) * kTick_s;
    for (Eigen::Index i = 0; i < q.size(); ++i) {
      out.q[k][i] = q[i] + synthesizer::faded(off[i], rate[i], since_s, kTakeOver_s);
    }
  }
  return out;
}

namespace {

using Eigen::Isometry3d;
using walker::kTick_s;

walker::Sensors to_walker(const hw::sim::BodySensors& s) {
  return {s.q, s.dq, s.R_WI, s.gyro_I, s.specific_force_I, s.foot_S};
}

/// Recomputes the legs for the stabilizer's corrections.
class Corrected {
 public:
  Corrected(const robot::Biped& biped, const walker::StabilizerSettings& settings)
      : biped_(biped),
        stabilizer_(biped, walker::gait_settings(biped), settings),
        ik_{robot::LegIk(biped, robot::kLeft), robot::LegIk(biped, robot::kRight)} {}

  double dcm_error_m() const { return dcm_error_m_; }
  Eigen::VectorXd step(const walker::StabilizerPlan& plan, const Eigen::VectorXd& q,
                       const walker::Sensors& sensors) {
    walker::StabilizerPlan p = plan;
    p.pattern.zmp_W_m += moved_W_m_;
    p.pattern.com.p_W_m += moved_W_m_;
    p.com.p_W_m += moved_W_m_;
    for (auto& foot : p.pattern.foot) {
      foot.X_WS.translation().head<2>() += moved_W_m_;
    }
    Isometry3d X_WB = plan.X_WB_last;
    X_WB.translation().head<2>() += moved_W_m_;
    p.X_WB_last = X_WB_ ? *X_WB_ : X_WB;
    const walker::StabilizerCommand& c = stabilizer_.step(p, sensors);
    X_WB.translation().head<2>() += c.com_shift_W_m;
    moved_W_m_ += c.pattern_shift_W_m;
    dcm_error_m_ = std::max(dcm_error_m_, c.dcm_error_W_m.norm());
    Eigen::VectorXd out = q;
    for (const robot::Side s : robot::kSides) {
      const auto legs = ik_[s].solve(X_WB.inverse() * c.X_WS[s]);
      for (std::size_t i = 0; i < 6; ++i) {
        out[biped_.leg[s].dof[i]] = legs.q[static_cast<Eigen::Index>(i)];
      }
    }
    X_WB_ = X_WB;
    return out;
  }

 private:
  const robot::Biped& biped_;
  walker::Stabilizer stabilizer_;
  std::array<robot::LegIk, 2> ik_;
  std::optional<Isometry3d> X_WB_;
  /// By all adjusted steps: what is played goes on from where they came down, like the walker's
  /// pattern. Otherwise the stabilizer takes each for a jump of the plan and pushes the robot over.
  Eigen::Vector2d moved_W_m_ = Eigen::Vector2d::Zero();
  double dcm_error_m_ = 0.0;
};

}  // namespace

std::string Playing::text() const {
  std::string out = plant == hw::sim::Plant::servo ? "servos" : "springs";
  if (!adjust_steps) out += ", steps as planned";
  return out;
}

TrialResult play(const Robot& robot, const JointTrack& track, const Playing& how,
                 std::span<const hw::sim::Push> pushes) {
  hw::sim::BodyWorld world(robot.biped, robot.urdf_file, {.plant = how.plant});
  for (const hw::sim::Push& push : pushes) world.push(push);
  hw::sim::WalkJudge judge;
  walker::StabilizerSettings settings = launched_walker().stabilizer;
  settings.step_adjustment = how.adjust_steps;
  Corrected corrected(robot.biped, settings);
  std::vector<walker::StabilizerPlan> reference;
  if (how.feedback) reference = implied_reference(robot.biped, track);
  std::deque<walker::Sensors> on_their_way(kSensorDelayTicks, to_walker(world.sensors()));
  TrialResult result;
  for (std::size_t k = 0; k < track.q.size() && !world.truth().fell; ++k) {
    on_their_way.push_back(to_walker(world.sensors()));
    const Eigen::VectorXd q =
        how.feedback ? corrected.step(reference[k], track.q[k], on_their_way.front()) : track.q[k];
    on_their_way.pop_front();
    world.step({q.data(), static_cast<std::size_t>(q.size())}, kTick_s);
    judge.tick(world.truth(), std::nullopt);
  }
  result.figures = judge.figures();
  result.dcm_max_m = corrected.dcm_error_m();
  if (world.truth().fell) result.fell_at_s = world.time_s();
  return result;
}

}  // namespace mimesis::walk
