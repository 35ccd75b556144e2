#include "nodes/walker/check/feasible_gait.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "nodes/walker/filter/dynamic_filter.h"
#include "nodes/walker/pattern/generators.h"

namespace mimesis::walker {
namespace {

using Eigen::Vector3d, Eigen::VectorXd;

/// Joint torques: those of the motion less what the ground does at the feet. Of two feet each bears
/// the more the nearer the ZMP is to it; their centres of pressure are equally far from the soles'
/// origins and have the ZMP between them.
void take_off_ground(const robot::Biped& biped, const robot::Kinematics& kinematics,
                     const robot::Wrench& ground, const std::array<bool, 2>& contact,
                     robot::Jacobian& jacobian, VectorXd& torque) {
  const Eigen::Index dof = torque.size();
  Vector3d zmp = Vector3d::Zero();
  zmp.head<2>() = robot::zmp_of(ground);
  const auto sole = [&](Side side) { return kinematics.X_WL(biped.leg[side].sole).translation(); };
  const Vector3d across = sole(kLeft) - sole(kRight);
  const double left =
      contact[kLeft] && contact[kRight]
          ? (zmp - sole(kRight)).head<2>().dot(across.head<2>()) / across.head<2>().squaredNorm()
          : (contact[kLeft] ? 1.0 : 0.0);
  const std::array<double, 2> share{std::clamp(left, 0.0, 1.0), 1.0 - std::clamp(left, 0.0, 1.0)};
  const Vector3d off = zmp - share[kLeft] * sole(kLeft) - share[kRight] * sole(kRight);
  const Vector3d rest = ground.moment - zmp.cross(ground.force);
  for (const Side side : robot::kSides) {
    if (share[side] <= 0.0) continue;
    kinematics.jacobian(biped.leg[side].sole, sole(side) + off, jacobian);
    torque -= share[side] * (jacobian.topRows<3>().rightCols(dof).transpose() * ground.force +
                             jacobian.bottomRows<3>().rightCols(dof).transpose() * rest);
  }
}

/// A pendulum falls in a time that grows as the root of its height: so do steps. And a push from
/// the side by 0.17 m/s (10 N s on biped.urdf) beyond what the sole holds grows until the landing,
/// where it is to be within what a landing may be moved by [docs/walking.md eq. 6.7].
double step_time(const robot::Biped& biped, const GaitSettings& own) {
  constexpr double kPush_m_s = 10.0 / 58.0, kAside_m = 0.12, kLeast_s = 0.5;
  const GaitSettings standard;
  double step_s = standard.step_s * std::sqrt(own.com_height_m / standard.com_height_m);
  const double omega = std::sqrt(robot::kGravity / own.com_height_m);
  const robot::Biped::Leg& leg = biped.leg[kLeft];
  const double held = std::min(-leg.min_S_m.y(), leg.max_S_m.y());
  const double beyond = kPush_m_s / omega - held;
  if (beyond > 0.0) step_s = std::min(step_s, std::log((kAside_m - held) / beyond) / omega);
  return std::max(kLeast_s, std::round(10.0 * step_s) / 10.0);
}

}  // namespace

GaitLoad load_of_gait(const robot::Biped& biped, const GaitSettings& gait, const Wish& wish,
                      bool filtered) {
  constexpr int kLandings = 6, kMostTicks = 4000, kEach = 3;
  NonlinearMpc pattern(gait);
  std::array<Footprint, 2> feet;
  for (const Side side : robot::kSides) {
    feet[side] = {side, {0.0, robot::sign(side) * 0.5 * gait.feet_distance_m}, 0.0};
  }
  pattern.reset(feet);
  WholeBody body(biped, gait.com_height_m);
  UpperBody upper;
  upper.q = biped.half_sitting(biped.upper_body);
  upper.dq = upper.ddq = VectorXd::Zero(upper.q.size());
  const WholeBody::Moments moments = body.moments(upper);
  const FilterSettings settings;
  std::optional<DynamicFilter> filter;
  if (filtered) filter.emplace(biped, gait, settings);
  const std::vector<UpperBody> ahead(static_cast<std::size_t>(settings.samples), upper);
  robot::Dynamics dynamics(biped.tree);
  robot::Kinematics kinematics(biped.tree);
  robot::Jacobian jacobian(6, 6 + biped.tree.dof());
  VectorXd torque(biped.tree.dof());
  GaitLoad load;
  for (int tick = 0; tick < kMostTicks && pattern.now().steps < kLandings; ++tick) {
    pattern.step(wish);
    const PatternSample& now = pattern.now();
    const ComState com = filter ? now.com + filter->step(pattern, ahead) : now.com;
    if (tick % kEach != 0) continue;
    const robot::RobotMotion& motion = body.motion(now, com, upper, moments);
    if (body.unreachable()) {
      ++load.short_ticks;
      continue;
    }
    const robot::Wrench ground = dynamics.inverse_dynamics(motion, torque);
    if (!(ground.force.z() > 0.0)) {  // it would leave the ground: its legs jerk at their end
      ++load.short_ticks;
      continue;
    }
    kinematics.update(motion.X_WB, motion.q);
    take_off_ground(biped, kinematics, ground, now.contact, jacobian, torque);
    for (const robot::Biped::Leg& leg : biped.leg) {
      for (const int dof : leg.dof) {
        const robot::Link& link = biped.tree.moved(dof);
        const double speed = std::abs(motion.dq[dof]), moment = std::abs(torque[dof]);
        if (speed > load.speed_share * link.max_speed) {
          load.speed_share = speed / link.max_speed;
          load.speed_rad_s = speed;
          load.speed_joint = link.joint;
        }
        if (link.max_effort > 0.0 && moment > load.torque_share * link.max_effort) {
          load.torque_share = moment / link.max_effort;
          load.torque_n_m = moment;
          load.torque_joint = link.joint;
        }
      }
    }
  }
  return load;
}

FeasibleGait feasible_gait(const robot::Biped& biped, double share) {
  GaitSettings own = gait_settings(biped);
  own.step_s = step_time(biped, own);
  // With the dynamic filter torques are lower, and computing them takes ten times as long: it is
  // asked only where it can change the answer.
  constexpr double kFilterMayHelp = 1.6;
  const auto load_of = [&](const GaitSettings& gait, const Wish& wish) {
    const GaitLoad load = load_of_gait(biped, gait, wish, false);
    const bool may_help = load.short_ticks == 0 && load.speed_share <= share &&
                          load.torque_share > share && load.torque_share < kFilterMayHelp * share;
    return may_help ? load_of_gait(biped, gait, wish, true) : load;
  };
  const auto fits = [share](const GaitLoad& load) {
    return load.short_ticks == 0 && load.speed_share <= share && load.torque_share <= share;
  };
  FeasibleGait best;
  best.gait = own;
  bool tried = false;
  double best_speed = 0.0;
  for (const double longer_s : {0.0, 0.2, 0.4}) {
    const double step_s = std::min(1.2, std::round(10.0 * (own.step_s + longer_s)) / 10.0);
    for (const double height : {1.0, 0.6}) {
      GaitSettings gait = own;
      gait.step_s = step_s;
      gait.step_height_m *= height;
      Wish wish;
      const GaitLoad in_place = load_of(gait, wish);
      const auto worst = [](const GaitLoad& l) { return std::max(l.speed_share, l.torque_share); };
      if (!best.possible && (!tried || worst(in_place) < worst(best.load))) {
        best.load = in_place;
        best.gait = gait;
      }
      tried = true;
      if (!fits(in_place)) continue;
      // The fastest of ten speeds: what fits at one fits at all below.
      constexpr int kSpeeds = 10;
      int fast = static_cast<int>(std::lround(kSpeeds * best_speed / own.most_forward_m_s)),
          slow = kSpeeds;
      for (int speed = kSpeeds; fast < slow; speed = (fast + slow + 1) / 2) {
        wish.velocity_m_s.x() = own.most_forward_m_s * speed / kSpeeds;
        const GaitLoad now = load_of(gait, wish);
        if (!fits(now)) {
          slow = speed - 1;
          continue;
        }
        fast = speed;
        best.possible = true;
        best.gait = gait;
        best.load = now;
        best_speed = best.gait.most_forward_m_s = wish.velocity_m_s.x();
        best.slowed = fast < kSpeeds || step_s > own.step_s || height < 1.0;
      }
      if (best.possible && !best.slowed) break;
    }
    if (best_speed >= 0.6 * own.most_forward_m_s) break;
  }
  if (best.slowed) {
    Wish wish;
    wish.velocity_m_s.x() = own.most_forward_m_s;
    best.beyond = load_of(own, wish);
  }
  if (!best.possible) return best;
  // Sideways and turning as far as they fit, too.
  for (const double part : {1.0, 0.8, 0.6, 0.4, 0.2, 0.1}) {
    Wish wish;
    wish.velocity_m_s.y() = part * own.most_sideways_m_s;
    best.gait.most_sideways_m_s = wish.velocity_m_s.y();
    if (fits(load_of(best.gait, wish))) break;
  }
  for (const double part : {1.0, 0.8, 0.6, 0.4, 0.2, 0.1}) {
    Wish wish;
    wish.yaw_rate_rad_s = part * own.most_turn_rad_s;
    best.gait.most_turn_rad_s = wish.yaw_rate_rad_s;
    if (fits(load_of(best.gait, wish))) break;
  }
  best.slowed |= best.gait.most_sideways_m_s < own.most_sideways_m_s ||
                 best.gait.most_turn_rad_s < own.most_turn_rad_s;
  return best;
}

}  // namespace mimesis::walker
