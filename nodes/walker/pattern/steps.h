#pragma once
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Motion along the ground of a foot in the air: x, y, yaw and their rates.
struct PlanarState {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero(),
                  a = Eigen::Vector3d::Zero();
};
/// State at time `t` on the polynomial of fifth degree that leads from `state` to rest at `goal` in
/// `D` > 0 seconds; from D on at rest.
PlanarState quintic(const PlanarState& state, const Eigen::Vector3d& goal, double D, double t);

/// Feet that carry the robot at one instant: those that stand now (`both`), or the footprints i and
/// j of the plan: 0 is the foot that stands alone, 1 to 3 the coming landings.
struct Support {
  bool both = false;
  int i = 0, j = 0;  ///< equal: one foot
};

/// Timing of standing and stepping, and motion of the feet [docs/walking.md 4]:
///   standing → starting (double support) → steps → settling (double support) → standing.
/// A step is double support first, then swing. The foot moves along the ground from a twentieth of
/// its swing until a seventh before its end, so that it is in place before it may meet ground that
/// is higher than planned. Steps is a value: an advanced copy is the preview.
class Steps {
 public:
  enum class Phase { stand, start, step, settle };

  /// When a change of mind takes effect: at once, or after the next landing.
  enum class Change { at_once, after_landing };
  Steps(const GaitSettings& settings, Change change);
  void reset(const std::array<Footprint, 2>& feet);

  /// Starts, stops or continues. `settled`: the CoM rests above the middle of the feet.
  void decide(bool walk, Side first_swing, bool settled);
  /// Sets landing number `ahead`, 0 is the next. The side of `landing` is ignored.
  void plan(int ahead, const Footprint& landing);
  /// Advances by this many ticks with the planned landings.
  void advance(int ticks);

  Phase phase() const { return phase_; }
  Side swing() const { return swing_; }
  const Footprint& stance() const { return ground_[robot::other(swing_)]; }
  /// Footprints where the feet stand or stood before they were lifted.
  const std::array<Footprint, 2>& ground() const { return ground_; }
  const Footprint& landing(int ahead) const { return next_[static_cast<std::size_t>(ahead)]; }
  /// Landings until the robot stands; −1: it keeps walking.
  int landings_left() const { return landings_left_; }
  bool stopping() const { return phase_ == Phase::settle || landings_left_ >= 0; }
  int ticks_to_sample() const;  ///< to the next multiple of the sampling time, ≥ 1
  int tick() const { return tick_; }
  Support support_after(int ticks) const;
  /// Time [s] from `ahead_s`, when one foot carries, to the landing of the other.
  double until_next_landing_s(double ahead_s) const;
  /// Time during which the swing foot can still be led to another landing [s].
  double free_time_s() const;
  /// Fills all of PatternSample except CoM, ZMP and share of weight.
  void describe(PatternSample& sample) const;
  Eigen::Vector2d middle_W_m() const;  ///< middle of the feet on the ground
  double yaw_rad() const;              ///< mean yaw of the feet now
  void shift(const Eigen::Vector2d& shift_W_m);

 private:
  void enter(Phase phase, int landings_left);
  void finish_phase();
  int length() const;  ///< ticks of the phase; endless: a large number
  PlanarState swing_after(int ticks) const;

  int step_, double_, first_double_, sample_;  // ticks
  // ticks of a step between which the foot moves along the ground
  int lift_, touch_;
  double height_m_;
  Change change_;
  Phase phase_ = Phase::stand;
  int tick_ = 0, landings_left_ = -1, landed_ = 0;
  Side swing_ = kLeft;
  std::array<Footprint, 2> ground_;
  std::array<Footprint, 3> next_;
  PlanarState air_;  // state of the swing foot
};

/// Ticks between the samples of the horizon: 0.1 s.
inline constexpr int kSampleTicks = 20;

/// Height of a sole in the air and its first two derivatives by the elapsed share of the swing.
struct SwingHeight {
  double z = 0.0, dz = 0.0, ddz = 0.0;
};

/// Swing of height 1 for u ∈ [0, 1]: up from rest, down, then a slow glide to rest. Ground that is
/// higher than planned is met with a force that grows with the foot's speed; below a tenth of the
/// height the glide has 0.6 of the speed of 64 (u (1 − u))³. Speeds are continuous; the
/// acceleration ends with the glide.
SwingHeight swing_height(double u);

inline Eigen::Matrix2d rotation(double yaw_rad) {
  return Eigen::Rotation2Dd(yaw_rad).toRotationMatrix();
}

/// n · d ≤ b for the step d from one foot to the other, in the frame of the standing foot.
struct HalfPlane {
  Eigen::Vector2d normal;
  double offset;
};
inline constexpr int kStepSides = 5;

/// A wish within the limits of the robot.
using FeasibleWish = Wish;

/// Foot of the first step: the one whose landing is wished, else the one on the side to which the
/// walk goes or turns.
Side first_swing(const FeasibleWish& wish);

/// Reachable landings, and the landings that belong to a wished velocity.
class Footsteps {
 public:
  explicit Footsteps(const GaitSettings& settings);

  /// Limits of a step of `swing` relative to the other foot [docs/walking.md 2.6].
  const std::array<HalfPlane, kStepSides>& limits(Side swing) const { return limits_[swing]; }
  /// Distance of a step beyond the limits [m]; ≤ 0: feasible.
  double beyond(Side swing, const Eigen::Vector2d& step_S_m) const;

  /// Step of `swing` from the other foot, in W, with which the pelvis moves at the velocity while
  /// it turns from yaw `from` to yaw `to`. The feet are as far apart as moving sideways requires.
  Eigen::Vector2d step_W_m(Side swing, double from_rad, double to_rad,
                           const Eigen::Vector2d& velocity_m_s) const;
  Footprint next(const Footprint& stance, const FeasibleWish& wish) const;
  /// Yaw closest to `wished` with which a foot may land next to one with yaw `from`.
  double reachable_yaw(double from_rad, double wished_rad) const;
  /// `landing` if it can be reached from `stance`, else the last reachable point on the way to it
  /// from the place beside `stance`.
  Footprint reachable(const Footprint& stance, const Footprint& landing) const;
  Footprint beside(const Footprint& stance) const;

  /// Cuts a wish to the limits of the robot and reports the excess in `trouble`.
  FeasibleWish feasible(const Wish& wish, PatternTrouble& trouble) const;

 private:
  double fastest_share(const Eigen::Vector2d& velocity_m_s, double yaw_rate_rad_s) const;

  GaitSettings settings_;
  std::array<std::array<HalfPlane, kStepSides>, 2> limits_;
};

}  // namespace mimesis::walker
