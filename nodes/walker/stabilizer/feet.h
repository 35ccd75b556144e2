#pragma once
#include "nodes/walker/stabilizer/estimator.h"
#include "nodes/walker/stabilizer/ground.h"

namespace mimesis::walker {

/// What forces and the body's error change of the planned soles [K10; walking.md 8.6.7].
/// A: gain, T: leak of each law.
///  - pressure, on a foot that carries: θ̇_y = A (M_y + p_x F_z) − θ_y/T,
///    θ̇_x = A (M_x − p_y F_z) − θ_x/T with the wished centre of pressure p; about the ankle: about
///    S it would move the ankle by h θ, and h θ'' is felt as a ZMP on stiff legs. In double support
///    the rates of both feet are blended towards their mean by load: soles that turn against each
///    other strain stiff legs.
///  - difference, in double support: ḋ = A ((F_L − F_R) − (2λ − 1) mg) − d/T with the wished left
///    share λ; the left sole goes up by d/2, the right one down. Only for a while after a
///    landing, then d is held: on stiff legs d rolls the body and moves the CoM by c = 4.1 d, whose
///    c''/ω² the force sensors feel as a gain that grows with the frequency.
///  - landing, a foot that touches before it is due goes down no more and gives way to its force,
///    but for a twentieth of the weight, F_0: l̇ = v_down + A (max(0, F_z) − F_0), the sole goes up
///    by l. What it has found of the ground's height is forgotten slowly.
///  - reach, a foot that is down by the plan and not felt goes on down; once it is due, difference
///    and give wait for it.
///  - swing: the sole is where it is planned although the base is not.
///  - give: legs that are c F shorter under their load F (LegGive) are made longer by c (F − mg/2)
///    for the wished F: the pelvis stays at its height and level while the weight changes feet.
class Feet {
 public:
  Feet(const robot::Biped& biped, const StabilizerSettings& settings);

  void reset();
  struct Measured {
    std::array<robot::Wrench, 2> foot_S;
    Eigen::Isometry3d X_WB_planned, X_WB;  ///< at the same instant
    double give_m_n = 0.0;                 ///< of a leg (LegGive)
  };
  /// Soles to track, in the frame of the plan.
  const std::array<Eigen::Isometry3d, 2>& step(const PatternSample& plan,
                                               const Ground::Shares& wished,
                                               const Measured& measured);
  /// The same without measurements: all corrections fade.
  const std::array<Eigen::Isometry3d, 2>& fade(const PatternSample& plan);

 private:
  struct Foot {
    Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();  ///< θ_x, θ_y
    double landing_m = 0.0, reach_m = 0.0;
    bool touched = false;                                    ///< in this swing, before it was due
    bool felt = true;                                        ///< since it was due
    Eigen::Vector3d swing_tilt_W = Eigen::Vector3d::Zero();  ///< axis-angle
    Eigen::Vector3d swing_shift_W = Eigen::Vector3d::Zero();
  };
  void press(const PatternSample& plan, const Ground::Shares& wished,
             const std::array<robot::Wrench, 2>& foot_S);
  void share_weight(const std::array<robot::Wrench, 2>& foot_S, double left);
  void stand(Foot& foot, double normal_n) const;
  void swing(Foot& foot, const PatternSample& plan, const FootState& planned,
             const Measured& measured, double normal_n) const;
  void land(Foot& foot, double planned_down_m_s, double normal_n) const;
  void reach(Foot& foot, bool found, double planned_down_m_s) const;
  void hold_swing(Foot& foot, const Eigen::Isometry3d& X_WS, const Measured& measured) const;
  void fade_swing(Foot& foot) const;
  void compose(const PatternSample& plan);

  const StabilizerSettings* settings_;
  const robot::Biped* biped_;
  double weight_n_, swing_share_;
  std::array<Foot, 2> foot_;
  double left_ = 0.5, give_m_n_ = 0.0;  ///< wished share of the left foot, give of a leg
  bool behind_ = false;                 ///< the share waited, and follows the wished one slowly
  double difference_m_ = 0.0, double_support_s_ = 0.0;
  std::array<Eigen::Isometry3d, 2> X_WS_;
};

}  // namespace mimesis::walker
