#pragma once
#include <array>

#include "common/robot/kinematics.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Keeps the CoM from being asked to rise where no knee can let the hips rise with it: trunk and
/// arms would be thrown up instead, and the tasks below, which want them back, would never let it
/// come to rest. l² = m + a cos(q − q₀) between hip and ankle, q₀ the stretched knee. What the CoM
/// has is never taken from it: lower tasks give way to that, as everywhere. A leg that was too
/// short bends again with a bounded acceleration of its knee: next to q₀ any speed of the hips is
/// one of the knee without bound.
class LegRoom {
 public:
  explicit LegRoom(const robot::Biped& biped);

  /// Angle of the knee joint at which hip and ankle are farthest apart.
  double straight_rad(Side side) const { return leg_[side].straight_rad; }

  /// What is known at the beginning of a tick.
  struct Tick {
    const robot::Kinematics& kinematics;
    Eigen::Ref<const Eigen::VectorXd> q;             ///< dof [rad]
    Eigen::Ref<const Eigen::VectorXd> lower, upper;  ///< of base and joints' ways: Limits::bounds()
    Eigen::Vector3d com_W_m, com_way_m;              ///< where it is, and its wished way in W
    std::array<Eigen::Vector3d, 2> feet_way_m;       ///< wished ways in W
    double dt_s;
  };
  /// The CoM's rise that is next to the wished one. Hips go with it, or also go on as trunk and
  /// arms have moved them against it in the last tick: the better of both counts. No allocation.
  double rise_m(const Tick& tick);
  double missing_m() const { return missing_m_; }  ///< of the last wish
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
  double missing_m_ = 0.0, bending_rad_ = 0.0;  // of the straighter knee, in the last tick
};

}  // namespace mimesis::walker
