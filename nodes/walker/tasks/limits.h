#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/robot/kinematics.h"
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/tasks/stack.h"

namespace mimesis::walker {

/// Limits the wished rise of the CoM to the range of the knees. Otherwise trunk and arms would be
/// thrown up instead, and the lower tasks, which want them back, would never come to rest. Hip and
/// ankle are l apart, l² = m + a cos(q − q₀), with q₀ the stretched knee. The CoM never has to sink
/// for this. A leg that was too short bends again with a bounded acceleration of its knee, because
/// next to q₀ the knee's speed is unbounded for any speed of the hips.
class LegRoom {
 public:
  explicit LegRoom(const robot::Biped& biped) {
    robot::Kinematics kinematics(biped.tree);
    for (const Side side : robot::kSides) {
      Leg& leg = leg_[side];
      leg.knee = biped.leg[side].dof[robot::kKnee];
      leg.thigh = begins_at(biped, side, robot::kHipLast);
      leg.ankle = begins_at(biped, side, robot::kAnkleFirst);
      leg.hip_T_m = biped.leg[side].hip_T_m;
      leg.ankle_A_m = biped.leg[side].ankle_A_m;
      // Distance of two points on either side of a hinge: l² = m + c cos q + s sin q.
      const auto squared = [&](double angle) {
        Eigen::VectorXd q = biped.half_sitting;
        q[leg.knee] = angle;
        kinematics.update(Eigen::Isometry3d::Identity(), q);
        return (leg.hip_W(kinematics) - leg.ankle_W(kinematics)).squaredNorm();
      };
      const double zero = squared(0.0), half = squared(std::numbers::pi),
                   quarter = squared(0.5 * std::numbers::pi);
      leg.middle_m2 = 0.5 * (zero + half);
      leg.straight_rad = std::atan2(quarter - leg.middle_m2, zero - leg.middle_m2);
      leg.swing_m2 = std::hypot(quarter - leg.middle_m2, zero - leg.middle_m2);
    }
  }

  /// Angle of the knee joint at which hip and ankle are farthest apart.
  double straight_rad(Side side) const { return leg_[side].straight_rad; }

  /// State and wishes at the beginning of a tick.
  struct Tick {
    const robot::Kinematics& kinematics;
    Eigen::Ref<const Eigen::VectorXd> q;  ///< dof [rad]
    Eigen::Ref<const Eigen::VectorXd> lower,
        upper;                           ///< bounds of the displacements, see Limits::bounds()
    Eigen::Vector3d com_W_m, com_way_m;  ///< present place and wished displacement in W
    std::array<Eigen::Vector3d, 2> feet_way_m;  ///< wished displacements in W
    double dt_s;
  };
  /// The feasible rise closest to the wished one. Two cases are compared, hips that follow the CoM
  /// and hips that keep moving against it as in the last tick; the better one counts. No
  /// allocation.
  double rise_m(const Tick& tick) {
    std::array<Eigen::Vector3d, 2> hip, with_com, going_on;
    for (const Side side : robot::kSides) {
      hip[side] = leg_[side].hip_W(tick.kinematics);
      with_com[side] = hip[side] - leg_[side].ankle_W(tick.kinematics) - tick.feet_way_m[side];
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
  double missing_m() const { return missing_m_; }  ///< part of the last wished rise that was cut
  void reset() {
    has_before_ = false;
    missing_m_ = bending_rad_ = 0.0;
  }

 private:
  // Used share of a knee's displacement; the rest is for the turning of the pelvis.
  static constexpr double kUsed = 0.9;
  static constexpr double kAcceleration_rad_s2 = 100.0;
  static constexpr double kShort_m = 1e-6;
  static constexpr double kAny_m = 1.0;
  static int begins_at(const robot::Biped& biped, Side side, robot::LegJoint joint) {
    return biped.tree.moved_link(biped.leg[side].dof[joint]);
  }
  /// Rise of the hip, now `way` from the ankle, with which the leg has the given length.
  static double rise_to(double length_m2, const Eigen::Vector3d& way) {
    return std::sqrt(std::max(0.0, length_m2 - way.head<2>().squaredNorm())) - way.z();
  }

  struct Leg {
    int knee = 0, thigh = 0, ankle = 0;  // dof; links that begin at hip and ankle
    Eigen::Vector3d hip_T_m, ankle_A_m;  // in these
    double straight_rad = 0.0, middle_m2 = 0.0, swing_m2 = 0.0;

    Eigen::Vector3d hip_W(const robot::Kinematics& k) const { return k.X_WL(thigh) * hip_T_m; }
    Eigen::Vector3d ankle_W(const robot::Kinematics& k) const { return k.X_WL(ankle) * ankle_A_m; }
    double length_m2(double bend_rad) const { return middle_m2 + swing_m2 * std::cos(bend_rad); }
    double bend_rad(double length) const {
      return std::acos(std::clamp((length - middle_m2) / swing_m2, -1.0, 1.0));
    }
  };
  struct Room {
    double least_m, most_m;
  };
  /// `way`: vector from ankle to hip at the end of the tick, without a rise.
  Room room(const Tick& tick, const std::array<Eigen::Vector3d, 2>& way) const {
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
  double bend_rad(const Tick& tick, Side side) const {
    return std::abs(tick.q[leg_[side].knee] - leg_[side].straight_rad);
  }
  Side straighter(const Tick& tick) const {
    return bend_rad(tick, kLeft) < bend_rad(tick, kRight) ? kLeft : kRight;
  }

  std::array<Leg, 2> leg_;
  std::array<Eigen::Vector3d, 2> hip_before_W_m_;  // in the last tick
  Eigen::Vector3d com_before_W_m_;
  bool has_before_ = false;
  // distance and bend of the straighter knee, in the last tick
  double missing_m_ = 0.0, bending_rad_ = 0.0;
};

/// How far base and joints may move within one tick. A joint approaches a limit, or returns from
/// beyond it, with a time constant of 20 ms at most.
class Limits {
 public:
  Limits(const robot::Biped& biped, const StackSettings& settings)
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

  /// Bounds of the displacements within dt from the joint positions q (dof [rad]): `lower` ≤
  /// `upper`, 6 + dof: the base [m], [rad] in W, then the joints [rad].
  void bounds(const Eigen::Ref<const Eigen::VectorXd>& q, double dt_s,
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
  const Eigen::VectorXd& lower() const { return lower_; }  ///< positions with margins, dof [rad]
  const Eigen::VectorXd& upper() const { return upper_; }  ///< positions with margins, dof [rad]

 private:
  // The base is no joint; this keeps absurd goals from throwing it about.
  static constexpr double kBase_m_s = 3.0, kBase_rad_s = 10.0;
  static constexpr double kApproach_1_s = 50.0;  // rate of approach to a limit

  void keep_knees_bent(const robot::Biped& biped, double margin_rad) {
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
  Eigen::VectorXd lower_, upper_, speed_;
};

}  // namespace mimesis::walker
