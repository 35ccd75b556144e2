#pragma once
#include <Eigen/Core>
#include <array>
#include <span>

#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/estimator.h"

namespace mimesis::walker {

/// Convex polygon of at most eight corners: two soles. No allocation.
class Polygon {
 public:
  static constexpr int kMost = 8;
  /// Hull of `points` (1 to kMost), counter-clockwise [Andrew 1979].
  explicit Polygon(std::span<const Eigen::Vector2d> points);

  std::span<const Eigen::Vector2d> corners() const { return {corner_.data(), std::size_t(size_)}; }
  bool contains(const Eigen::Vector2d& p) const;
  /// p itself if it is inside, or the nearest point of the border.
  Eigen::Vector2d nearest(const Eigen::Vector2d& p) const;

 private:
  std::array<Eigen::Vector2d, 2 * kMost> corner_;
  int size_ = 0;
};

/// Reachable ZMPs while the planned feet carry, and the forces that each foot has to give for one
/// [docs/walking.md 6.3].
class Ground {
 public:
  /// @param margin_m  distance kept from the edges of the soles
  Ground(const robot::Biped& biped, double margin_m) : biped_(&biped), margin_(margin_m) {}

  /// Point of the support polygon nearest to `zmp_W_m`.
  Eigen::Vector2d reachable(const PatternSample& plan, const Eigen::Vector2d& zmp_W_m) const;

  struct Shares {
    double left = 0.5;                       ///< share of the weight
    std::array<Eigen::Vector2d, 2> cop_S_m;  ///< wished centre of pressure under each foot
  };
  /// Splits `zmp_W_m` along the line between the ankles; the remainder becomes the wished centre of
  /// pressure of both feet alike, cut to the soles.
  Shares distribute(const PatternSample& plan, const Eigen::Vector2d& zmp_W_m) const;

 private:
  Eigen::Vector2d on_sole(Side side, const Eigen::Vector2d& p_S_m) const;

  const robot::Biped* biped_;
  double margin_;
};

/// ZMP of both feet's wrenches for feet that stand as planned; nothing below `least_n` of normal
/// force.
std::optional<Eigen::Vector2d> measured_zmp(const PatternSample& plan,
                                            const std::array<robot::Wrench, 2>& foot_S,
                                            double least_n);

/// Corrections of the planned soles by the measured forces and the error of the body
/// [K10; docs/walking.md 6.5]. A: gain, T: leak of each law.
///  - pressure, on a foot that carries, for the wished centre of pressure p:
///    θ̇_y = A (M_y + p_x F_z) − θ_y/T,  θ̇_x = A (M_x − p_y F_z) − θ_x/T                   [eq. 6.3]
///    The sole turns about a point near the ankle: about S it would move the ankle by h θ, and h θ̈
///    is felt as a ZMP on stiff legs. In double support the rates of both feet are blended towards
///    their mean by load, because soles that turn against each other strain stiff legs.
///  - difference, in double support, for the wished left share λ:
///    ḋ = A ((F_L − F_R) − (2λ − 1) mg) − d/T [eq. 6.4]. The left sole goes up by d/2, the right
///    one down. The law acts for a while after a landing, then d is held: on stiff legs d rolls the
///    body and moves the CoM by c = 4.1 d, whose c̈/ω² the force sensors feel as a gain that grows
///    with the frequency.
///  - landing: a foot that touches before it is due stops going down and gives way to its force
///    above F₀, a twentieth of the weight: l̇ = v_down + A (max(0, F_z) − F₀), the sole goes up by l
///    [eq. 6.5]. The height of the ground that it has found is forgotten slowly.
///  - reach: a foot that is down by the plan without ground contact moves on down; once it is due,
///    difference and give wait for it.
///  - swing: the sole stays at its planned place although the base is off.
///  - give: legs that are c F shorter under load F (LegGive) are made longer by c (F − mg/2) for
///    the wished F, so that the pelvis keeps its height and stays level while the weight changes
///    feet.
class Feet {
 public:
  Feet(const robot::Biped& biped, const StabilizerSettings& settings);

  void reset();
  struct Measured {
    std::array<robot::Wrench, 2> foot_S;
    Eigen::Isometry3d X_WB_planned, X_WB;  ///< at the same instant
    double give_m_n = 0.0;                 ///< compliance of a leg (LegGive)
  };
  /// Soles to track, in the frame of the plan.
  const std::array<Eigen::Isometry3d, 2>& step(const PatternSample& plan,
                                               const Ground::Shares& wished,
                                               const Measured& measured);
  /// Ground contact of a swing foot before it is due.
  bool touched(Side side) const { return foot_[side].touched; }
  /// step() without measurements: all corrections fade.
  const std::array<Eigen::Isometry3d, 2>& fade(const PatternSample& plan);

 private:
  struct FootControl {
    Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();  ///< θ_x, θ_y
    double landing_m = 0.0, reach_m = 0.0;
    bool touched = false;  ///< ground contact in this swing, before due
    bool felt = true;      ///< ground contact since it was due
    Eigen::Vector3d swing_tilt_W = Eigen::Vector3d::Zero();  ///< axis-angle
    Eigen::Vector3d swing_shift_W = Eigen::Vector3d::Zero();
  };
  void press(const PatternSample& plan, const Ground::Shares& wished,
             const std::array<robot::Wrench, 2>& foot_S);
  void share_weight(const std::array<robot::Wrench, 2>& foot_S, double left);
  void stand(FootControl& foot, double normal_n) const;
  void swing(FootControl& foot, const PatternSample& plan, const FootState& planned,
             const Measured& measured, double normal_n) const;
  void land(FootControl& foot, double planned_down_m_s, double normal_n) const;
  void reach(FootControl& foot, bool found, double planned_down_m_s) const;
  void hold_swing(FootControl& foot, const Eigen::Isometry3d& X_WS, const Measured& measured) const;
  void fade_swing(FootControl& foot) const;
  void compose(const PatternSample& plan);

  const StabilizerSettings* settings_;
  const robot::Biped* biped_;
  double weight_n_, swing_share_;
  std::array<FootControl, 2> foot_;
  double left_ = 0.5, give_m_n_ = 0.0;  ///< wished share of the left foot, give of a leg
  bool behind_ = false;                 ///< the share waited and follows the wished one slowly
  double difference_m_ = 0.0, double_support_s_ = 0.0;
  std::array<Eigen::Isometry3d, 2> X_WS_;
};

}  // namespace mimesis::walker
