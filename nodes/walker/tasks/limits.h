#pragma once
#include <array>

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
  explicit LegRoom(const robot::Biped& biped);

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
  double rise_m(const Tick& tick);
  double missing_m() const { return missing_m_; }  ///< part of the last wished rise that was cut
  void reset();

 private:
  struct Leg {
    int knee = 0, thigh = 0, ankle = 0;  // dof; links that begin at hip and ankle
    double straight_rad = 0.0, middle_m2 = 0.0, swing_m2 = 0.0;

    double length_m2(double bend_rad) const { return middle_m2 + swing_m2 * std::cos(bend_rad); }
    double bend_rad(double length_m2) const;
  };
  struct Room {
    double least_m, most_m;
  };
  Room room(const Tick& tick, const std::array<Eigen::Vector3d, 2>& way) const;
  double bend_rad(const Tick& tick, Side side) const;
  Side straighter(const Tick& tick) const;

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
  Limits(const robot::Biped& biped, const StackSettings& settings);

  /// Bounds of the displacements within dt from the joint positions q (dof [rad]): `lower` ≤
  /// `upper`, 6 + dof: the base [m], [rad] in W, then the joints [rad].
  void bounds(const Eigen::Ref<const Eigen::VectorXd>& q, double dt_s,
              Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const;
  const Eigen::VectorXd& lower() const { return lower_; }  ///< positions with margins, dof [rad]
  const Eigen::VectorXd& upper() const { return upper_; }  ///< positions with margins, dof [rad]

 private:
  void keep_knees_bent(const robot::Biped& biped, double margin_rad);
  Eigen::VectorXd lower_, upper_, speed_;
};

}  // namespace mimesis::walker
