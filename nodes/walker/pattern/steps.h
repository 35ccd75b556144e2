#pragma once
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Motion along the ground of a foot in the air: x, y, yaw and their rates.
struct PlanarState {
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero(),
                  a = Eigen::Vector3d::Zero();
};
/// After `t` of the polynomial of fifth degree that comes from `state` to rest in `goal` in `D` > 0
/// seconds; from D on: rest.
PlanarState quintic(const PlanarState& state, const Eigen::Vector3d& goal, double D, double t);

/// What carries the robot at one instant: the feet that stand now (`both`), or the mean of the
/// planned footprints i and j: 0 the foot that stands alone, 1 to 3 the coming landings.
struct Support {
  bool both = false;
  int i = 0, j = 0;  ///< equal: one foot
};

/// Timing of standing and stepping, and motion of the feet [walking.md 1.4, 8.6.0]:
///   standing → starting (double support) → steps → settling (double support) → standing.
/// A step is double support first, then swing; the foot moves along the ground from a twentieth of
/// its swing on and is there a seventh before its end, before it may find ground that is higher
/// than planned. A value: a copy of it, advanced, is the preview.
class Steps {
 public:
  enum class Phase { kStand, kStart, kStep, kSettle };

  /// How late the walk may be changed: at once, or only what comes after the next landing.
  enum class Change { kAtOnce, kAfterLanding };
  Steps(const GaitSettings& settings, Change change);
  void reset(const std::array<Footprint, 2>& feet);

  /// Starts, stops or goes on. `settled`: the CoM rests above the middle of the feet.
  void decide(bool walk, Side first_swing, bool settled);
  /// Landing number `ahead`, 0 the next. Sides are set here.
  void plan(int ahead, const Footprint& landing);
  /// Goes on by this many ticks with what is planned.
  void advance(int ticks);

  Phase phase() const { return phase_; }
  Side swing() const { return swing_; }
  const Footprint& stance() const { return ground_[robot::other(swing_)]; }
  /// Where the feet stand, or stood before they were lifted.
  const std::array<Footprint, 2>& ground() const { return ground_; }
  const Footprint& landing(int ahead) const { return next_[static_cast<std::size_t>(ahead)]; }
  /// Landings until the robot stands; −1: it goes on walking.
  int landings_left() const { return landings_left_; }
  bool stopping() const { return phase_ == Phase::kSettle || landings_left_ >= 0; }
  int ticks_to_sample() const;  ///< to the next multiple of the sampling time, ≥ 1
  int tick() const { return tick_; }
  Support support_after(int ticks) const;
  /// From a time ahead [s] when one foot carries to the landing of the other.
  double until_next_landing_s(double ahead_s) const;
  /// Time in which the swing foot can still be led to another landing [s].
  double free_time_s() const;
  /// All of PatternSample but CoM, ZMP and share of weight.
  void describe(PatternSample& sample) const;
  Eigen::Vector2d middle_W_m() const;  ///< of the feet on the ground
  double yaw_rad() const;              ///< mean of the feet as they are now
  void shift(const Eigen::Vector2d& shift_W_m);

 private:
  void enter(Phase phase, int landings_left);
  void finish_phase();
  int length() const;  ///< of the phase; endless: a large number
  PlanarState swing_after(int ticks) const;

  int step_, double_, first_double_, sample_;  // ticks
  int lift_, touch_;                           // of a step: moving along the ground between them
  double height_m_;
  Change change_;
  Phase phase_ = Phase::kStand;
  int tick_ = 0, landings_left_ = -1, landed_ = 0;
  Side swing_ = kLeft;
  std::array<Footprint, 2> ground_;
  std::array<Footprint, 3> next_;
  PlanarState air_;  // of the swing foot
};

/// Ticks between the samples of the horizon: 0.1 s.
inline constexpr int kSampleTicks = 20;

}  // namespace mimesis::walker
