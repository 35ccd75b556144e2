#pragma once
#include <Eigen/Core>
#include <optional>

#include "nodes/synthesizer/character/courses.h"
#include "nodes/synthesizer/character/repertoire.h"

namespace mimesis::synthesizer {

struct WalkSettings {
  double dt_s = 1.0 / 60.0;
  double style_beta = 0.2;      ///< β of event-based transitions [M18 eq. 3.23] [1]
  double turn_gain_1_s = 1.5;   ///< gain of the goal-finding term [M18 eq. 3.25]
  double turn_max_rad_s = 0.8;  ///< largest yaw rate
  /// A goal within this distance is reached; twice the distance if the character has stopped on its
  /// way.
  double goal_tolerance_m = 0.15;
  double longest_step = 1.15;   ///< longest step, in steps of the style [1]
  double shortest_cycle = 0.6;  ///< fastest rhythm: share of the style's cycle [1]
  double longest_cycle = 1.8;   ///< slowest rhythm [1]
  double give_up_s = 20.0;      ///< reports a goal that came no nearer for this long
};

/// Gait that a coordinator or a rhythm wishes; the character decides itself on absent values.
struct GaitWish {
  std::optional<double> phase_rate_rad_s{}, step_length_m{}, heading_rad{};
};

enum class WalkTask {
  free,  ///< no goal: walks while it is wished to
  walk_to,
  stop
};

/// A value that follows another without jumps of its rate: critically damped.
class Follower {
 public:
  explicit Follower(double value) : value_(value) {}
  void follow(double target, double omega_1_s, double dt_s) {
    rate_ += dt_s * omega_1_s * (omega_1_s * (target - value_) - 2.0 * rate_);
    value_ += dt_s * rate_;
  }
  double value() const { return value_; }

 private:
  double value_, rate_ = 0.0;
};

/// Decides what one character does next: the shares of the repertoire's motions in it, its
/// frequency and its turn. It gets the character's place and does not depend on how it is drawn. No
/// allocation after construction.
///
/// Heading [M18 eq. 3.24, 3.25]: ψ̇ = k sin(ψ_goal − ψ), ±k beyond a right angle, at most
/// turn_max. The turn is made of the style's turning motions, as far as it has any, the rest by
/// pivoting on the standing foot. While the goal lies aside the steps become shorter, down to a
/// seventh: so every goal can be reached.
///
/// Length of the steps: a step of a·L metres is the style's walk with share a and standing with
/// 1 − a. At every landing foot, a is chosen so that whole steps and the closing half step end at
/// the goal.
class WalkControl {
 public:
  WalkControl(const Repertoire& repertoire, const WalkSettings& settings, int style, bool walking,
              double heading_rad);

  void walk_to(const Eigen::Vector2d& goal_W_m);
  void stop();
  void set_free(bool walking);
  /// Stands, or is in the middle of a walk, from now on.
  void resume(bool walking, double heading_rad);
  StyleCourse& style() { return style_; }
  const StyleCourse& style() const { return style_; }
  /// Held until the next call.
  void set_gait(const GaitWish& wish) { gait_ = wish; }

  /// One step of time at this place and phase.
  /// @param rhythm_rad  phase of the rhythm the character follows, if any: its first foot is the
  /// one that the rhythm has
  void step(const Eigen::Vector2d& position_W_m, double heading_rad, double phase_rad,
            std::optional<double> rhythm_rad);

  // results of the step
  std::span<const double> beta() const { return beta_; }  ///< one share per motion, sum 1
  bool blending() const { return blending_; }             ///< β is new, by 1e-5 or more
  double frequency_rad_s() const { return step_.moves() ? frequency_.value() : 0.0; }
  double pivot_rad_s() const { return pivot_rad_s_; }  ///< turn about the standing foot
  /// The phase to put the oscillator at, once: at the start of a walk.
  std::optional<double> phase_rad() const { return new_phase_rad_; }

  WalkTask task() const { return task_; }
  const Eigen::Vector2d& goal_W_m() const { return goal_; }
  StepCourse::Stage stage() const { return step_.stage(); }
  bool reached() const { return reached_; }
  bool stuck() const { return no_nearer_s_ > settings_.give_up_s; }
  double goal_distance_m() const { return distance_m_; }

 private:
  struct Style {  // mean style for the present shares
    double step_length_m, turn_rad, frequency_rad_s, closing;
  };
  Style mixed() const;
  void see_goal(const Eigen::Vector2d& position_W_m, double heading_rad);
  void plan(const Style& style);
  double wished_turn(double heading_rad) const;
  void mix(const Style& style);

  const Repertoire* repertoire_;
  WalkSettings settings_;
  StyleCourse style_;
  StepCourse step_;
  GaitWish gait_;
  WalkTask task_ = WalkTask::free;
  Eigen::Vector2d goal_ = Eigen::Vector2d::Zero();
  bool walk_, reached_ = false, blending_ = true;
  bool stopped_ = false;    // on the way to this goal, once
  double heading_rad_;      // kept while there is no goal
  double aside_rad_ = 0.0;  // direction of the goal relative to the heading
  double distance_m_ = 0.0, nearest_m_ = 0.0, no_nearer_s_ = 0.0;
  double length_ = 1.0;  // a
  Follower length_follower_, turn_, frequency_;
  double pivot_rad_s_ = 0.0, last_phase_rad_ = 0.0;
  std::optional<double> new_phase_rad_;
  std::vector<double> beta_, last_beta_;  // now; when it was new
};

}  // namespace mimesis::synthesizer
