#include "experiments/walk/study/implied.h"

#include <cmath>

#include "common/math/so3.h"
#include "common/robot/kinematics.h"
#include "nodes/walker/stabilizer/estimator.h"

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

/// Of a moving frame, by differences.
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

}  // namespace mimesis::walk
