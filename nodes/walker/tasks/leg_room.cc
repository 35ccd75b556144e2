#include "nodes/walker/tasks/leg_room.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mimesis::walker {
namespace {

// Of the way that a knee may go: the rest is for the pelvis' turning.
constexpr double kUsed = 0.9;
constexpr double kAcceleration_rad_s2 = 100.0;
constexpr double kShort_m = 1e-6;
constexpr double kAny_m = 1.0;

/// Link that begins at a joint of a leg.
int begins_at(const robot::Biped& biped, Side side, robot::LegJoint joint) {
  return biped.tree.moved_link(biped.leg[side].dof[joint]);
}

/// Until a leg whose hip is `way` from its ankle has another length.
double rise_to(double length_m2, const Eigen::Vector3d& way) {
  return std::sqrt(std::max(0.0, length_m2 - way.head<2>().squaredNorm())) - way.z();
}

}  // namespace

LegRoom::LegRoom(const robot::Biped& biped) {
  robot::Kinematics kinematics(biped.tree);
  for (const Side side : robot::kSides) {
    Leg& leg = leg_[side];
    leg.knee = biped.leg[side].dof[robot::kKnee];
    leg.thigh = begins_at(biped, side, robot::kHipLast);
    leg.ankle = begins_at(biped, side, robot::kAnkleFirst);
    // Two points on either side of a hinge: l² = middle + c cos q + s sin q.
    const auto squared = [&](double angle) {
      Eigen::VectorXd q = biped.half_sitting;
      q[leg.knee] = angle;
      kinematics.update(Eigen::Isometry3d::Identity(), q);
      return (kinematics.X_WL(leg.thigh).translation() - kinematics.X_WL(leg.ankle).translation())
          .squaredNorm();
    };
    const double zero = squared(0.0), half = squared(std::numbers::pi),
                 quarter = squared(0.5 * std::numbers::pi);
    leg.middle_m2 = 0.5 * (zero + half);
    leg.straight_rad = std::atan2(quarter - leg.middle_m2, zero - leg.middle_m2);
    leg.swing_m2 = std::hypot(quarter - leg.middle_m2, zero - leg.middle_m2);
  }
}

double LegRoom::Leg::bend_rad(double length) const {
  return std::acos(std::clamp((length - middle_m2) / swing_m2, -1.0, 1.0));
}

void LegRoom::reset() {
  has_before_ = false;
  missing_m_ = bending_rad_ = 0.0;
}

/// `way`: from ankle to hip at the end of the tick, without a rise.
LegRoom::Room LegRoom::room(const Tick& tick, const std::array<Eigen::Vector3d, 2>& way) const {
  Room room{-kAny_m, kAny_m};
  for (const Side side : robot::kSides) {
    const Leg& leg = leg_[side];
    const double bend = tick.q[leg.knee] - leg.straight_rad,
                 one = leg.length_m2(bend + kUsed * tick.lower[6 + leg.knee]),
                 other = leg.length_m2(bend + kUsed * tick.upper[6 + leg.knee]);
    room.least_m = std::max(room.least_m, rise_to(std::min(one, other), way[side]));
    room.most_m = std::min(room.most_m, rise_to(std::max(one, other), way[side]));
  }
  if (missing_m_ > kShort_m) {
    const Side side = straighter(tick);
    const double faster =
        std::max(0.0, bending_rad_) + kAcceleration_rad_s2 * tick.dt_s * tick.dt_s;
    const double length = leg_[side].length_m2(bend_rad(tick, side) + faster);
    room.least_m = std::max(room.least_m, rise_to(length, way[side]));
  }
  return room;
}

double LegRoom::rise_m(const Tick& tick) {
  std::array<Eigen::Vector3d, 2> hip, with_com, going_on;
  for (const Side side : robot::kSides) {
    hip[side] = tick.kinematics.X_WL(leg_[side].thigh).translation();
    with_com[side] =
        hip[side] - tick.kinematics.X_WL(leg_[side].ankle).translation() - tick.feet_way_m[side];
    with_com[side].head<2>() += tick.com_way_m.head<2>();
    going_on[side] = with_com[side];
    if (!has_before_) continue;
    going_on[side] += hip[side] - hip_before_W_m_[side] - (tick.com_W_m - com_before_W_m_);
  }
  hip_before_W_m_ = hip;
  com_before_W_m_ = tick.com_W_m;
  has_before_ = true;

  const Room one = room(tick, with_com), other = room(tick, going_on);
  const double least = std::min(one.least_m, other.least_m),
               most = std::max({one.most_m, other.most_m, 0.0}), wished = tick.com_way_m.z(),
               rise = std::min(std::max(wished, least), most);
  const Side side = straighter(tick);
  const Eigen::Vector3d reached = with_com[side] + rise * Eigen::Vector3d::UnitZ();
  bending_rad_ = leg_[side].bend_rad(reached.squaredNorm()) - bend_rad(tick, side);
  missing_m_ = std::abs(wished - rise);
  return rise;
}

double LegRoom::bend_rad(const Tick& tick, Side side) const {
  return std::abs(tick.q[leg_[side].knee] - leg_[side].straight_rad);
}

Side LegRoom::straighter(const Tick& tick) const {
  return bend_rad(tick, kLeft) < bend_rad(tick, kRight) ? kLeft : kRight;
}

}  // namespace mimesis::walker
