#include "nodes/walker/tasks/limits.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mimesis::walker {
namespace {

// Used share of a knee's displacement; the rest is for the turning of the pelvis.
constexpr double kUsed = 0.9;
constexpr double kAcceleration_rad_s2 = 100.0;
constexpr double kShort_m = 1e-6;
constexpr double kAny_m = 1.0;

int begins_at(const robot::Biped& biped, Side side, robot::LegJoint joint) {
  return biped.tree.moved_link(biped.leg[side].dof[joint]);
}

/// Rise of the hip, now `way` from the ankle, with which the leg has the given length.
double rise_to(double length_m2, const Eigen::Vector3d& way) {
  return std::sqrt(std::max(0.0, length_m2 - way.head<2>().squaredNorm())) - way.z();
}

// The base is no joint; this keeps absurd goals from throwing it about.
constexpr double kBase_m_s = 3.0, kBase_rad_s = 10.0;
constexpr double kApproach_1_s = 50.0;  // rate of approach to a limit

}  // namespace

LegRoom::LegRoom(const robot::Biped& biped) {
  robot::Kinematics kinematics(biped.tree);
  for (const Side side : robot::kSides) {
    Leg& leg = leg_[side];
    leg.knee = biped.leg[side].dof[robot::kKnee];
    leg.thigh = begins_at(biped, side, robot::kHipLast);
    leg.ankle = begins_at(biped, side, robot::kAnkleFirst);
    // Distance of two points on either side of a hinge: l² = m + c cos q + s sin q.
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

/// `way`: vector from ankle to hip at the end of the tick, without a rise.
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

Limits::Limits(const robot::Biped& biped, const StackSettings& settings)
    : lower_(biped.tree.lower()),
      upper_(biped.tree.upper()),
      speed_(settings.speed_share * biped.tree.max_speed()) {
  for (Eigen::Index i = 0; i < lower_.size(); ++i) {
    const double room = std::min(settings.limit_margin_rad, 0.5 * (upper_[i] - lower_[i]));
    lower_[i] += room;
    upper_[i] -= room;
  }
  keep_knees_bent(biped, settings.knee_margin_rad);
}

void Limits::keep_knees_bent(const robot::Biped& biped, double margin_rad) {
  const LegRoom room(biped);
  for (const Side side : robot::kSides) {
    const int knee = biped.leg[side].dof[robot::kKnee];
    const double straight = room.straight_rad(side), bent = biped.half_sitting[knee];
    if (bent > straight) {
      lower_[knee] = std::clamp(straight + margin_rad, lower_[knee], upper_[knee]);
    } else {
      upper_[knee] = std::clamp(straight - margin_rad, lower_[knee], upper_[knee]);
    }
  }
}

void Limits::bounds(const Eigen::Ref<const Eigen::VectorXd>& q, double dt_s,
                    Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const {
  upper.head<3>().setConstant(kBase_m_s * dt_s);
  upper.segment<3>(3).setConstant(kBase_rad_s * dt_s);
  lower.head<6>() = -upper.head<6>();
  const double share = std::min(1.0, kApproach_1_s * dt_s);
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const double most = speed_[i] * dt_s;
    lower[6 + i] = std::clamp(share * (lower_[i] - q[i]), -most, most);
    upper[6 + i] = std::clamp(share * (upper_[i] - q[i]), -most, most);
  }
}

}  // namespace mimesis::walker
