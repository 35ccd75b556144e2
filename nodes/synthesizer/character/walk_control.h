#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "common/math/circle.h"
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
/// turning over the feet that stand. While the goal lies aside the steps become shorter, down to a
/// seventh: so every goal can be reached.
///
/// Length of the steps: a step of a·L metres is the style's walk with share a and standing with
/// 1 − a. At every landing foot, a is chosen so that whole steps and the closing half step end at
/// the goal.
class WalkControl {
 public:
  WalkControl(const Repertoire& repertoire, const WalkSettings& settings, int style, bool walking,
              double heading_rad)
      : repertoire_(&repertoire),
        settings_(settings),
        style_(repertoire.style_count(), style, settings.style_beta),
        step_(walking),
        walk_(walking),
        heading_rad_(heading_rad),
        length_follower_(1.0),
        turn_(0.0),
        frequency_(repertoire.motion(repertoire.style(style).straight).parameters.frequency_rad_s),
        beta_(repertoire.motions().size(), 0.0),
        last_beta_(beta_) {
    mix(mixed());
  }

  void walk_to(const Eigen::Vector2d& goal_W_m) {
    if (task_ != WalkTask::walk_to || goal_W_m != goal_) {
      reached_ = stopped_ = false;
      no_nearer_s_ = 0.0;
      nearest_m_ = std::numeric_limits<double>::infinity();
    }
    task_ = WalkTask::walk_to;
    goal_ = goal_W_m;
  }
  void stop() {
    task_ = WalkTask::stop;
    walk_ = reached_ = false;
    no_nearer_s_ = distance_m_ = 0.0;
  }
  void set_free(bool walking) {
    task_ = WalkTask::free;
    walk_ = walking;
    reached_ = false;
  }
  /// Stands, or is in the middle of a walk, from now on.
  void resume(bool walking, double heading_rad) {
    step_ = StepCourse(walking);
    heading_rad_ = heading_rad;
  }
  StyleCourse& style() { return style_; }
  const StyleCourse& style() const { return style_; }
  /// Held until the next call.
  void set_gait(const GaitWish& wish) { gait_ = wish; }

  /// One step of time at this place and phase.
  /// @param rhythm_rad  phase of the rhythm the character follows, if any: its first foot is the
  /// one that the rhythm has
  void step(const Eigen::Vector2d& position_W_m, double heading_rad, double phase_rad,
            std::optional<double> rhythm_rad) {
    const Style style = mixed();
    see_goal(position_W_m, heading_rad);
    if (gait_.heading_rad) heading_rad_ = *gait_.heading_rad;
    if (task_ == WalkTask::walk_to) heading_rad_ = heading_rad;
    const bool was_standing = step_.standing();
    if (was_standing || strike_between(last_phase_rad_, phase_rad) != Strike::none) plan(style);
    const bool walk = walk_ && length_ > 0.0;
    new_phase_rad_.reset();
    if (was_standing && walk) {  // weights are zero: the phase is free
      new_phase_rad_ = std::cos(rhythm_rad.value_or(phase_rad)) >= 0.0 ? 0.0 : std::numbers::pi;
      phase_rad = *new_phase_rad_;
    }
    last_phase_rad_ = phase_rad;
    step_.advance(phase_rad, walk);
    if (step_.standing() && !was_standing) stopped_ = true;
    style_.advance(settings_.dt_s, phase_rad, step_.standing());

    const double own = style.frequency_rad_s;
    const double wished = std::clamp(gait_.phase_rate_rad_s.value_or(own),
                                     own / settings_.longest_cycle, own / settings_.shortest_cycle);
    frequency_.follow(wished, kFollow_1_s, settings_.dt_s);
    length_follower_.follow(length_, kFollow_1_s, settings_.dt_s);
    turn_.follow(step_.moves() ? wished_turn(heading_rad) : 0.0, kFollow_1_s, settings_.dt_s);
    mix(style);
  }

  // results of the step
  std::span<const double> beta() const { return beta_; }  ///< one share per motion, sum 1
  bool blending() const { return blending_; }             ///< β is new, by 1e-5 or more
  double frequency_rad_s() const { return step_.moves() ? frequency_.value() : 0.0; }
  double pivot_rad_s() const { return pivot_rad_s_; }  ///< turn beside the motions'
  /// The phase to put the oscillator at, once: at the start of a walk.
  std::optional<double> phase_rad() const { return new_phase_rad_; }

  WalkTask task() const { return task_; }
  const Eigen::Vector2d& goal_W_m() const { return goal_; }
  StepCourse::Stage stage() const { return step_.stage(); }
  bool reached() const { return reached_; }
  bool stuck() const { return no_nearer_s_ > settings_.give_up_s; }
  double goal_distance_m() const { return distance_m_; }

 private:
  static constexpr double kShortestStep =
      0.1;  // share of the style's step: shorter ones only shuffle
  static constexpr double kTurningStep = 0.15;  // while the goal lies aside
  static constexpr double kAhead = 0.4;         // rad: at this angle aside, steps are whole ...
  static constexpr double kAside = 1.2;         // ... and from here as short as kTurningStep
  static constexpr double kNearer_m = 0.1;
  static constexpr double kNear = 3.0;  // steps
  static constexpr double kMiss =
      0.7;  // share of the tolerance by which a character may pass the goal
  static constexpr double kFollow_1_s = 8.0;
  static constexpr double kSameShare = 1e-5;  // some 1e-5 rad at the joints

  struct Style {  // mean style for the present shares
    double step_length_m, turn_rad, frequency_rad_s, closing;
  };
  Style mixed() const {
    Style sum{0.0, 0.0, 0.0, 0.0};
    const auto shares = style_.shares();
    for (int s = 0; s < repertoire_->style_count(); ++s) {
      const double share = shares[static_cast<std::size_t>(s)];
      const StyleMotions& style = repertoire_->style(s);
      const RepertoireMotion& walk = repertoire_->motion(style.straight);
      sum.step_length_m += share * walk.step_length_m;
      sum.turn_rad += share * walk.turn_rad;
      sum.frequency_rad_s += share * walk.parameters.frequency_rad_s;
      sum.closing += share * style.closing_share;
    }
    return sum;
  }
  void see_goal(const Eigen::Vector2d& position_W_m, double heading_rad) {
    if (task_ != WalkTask::walk_to) return;
    const Eigen::Vector2d to = goal_ - position_W_m;
    distance_m_ = to.norm();
    aside_rad_ = distance_m_ > 1e-9 ? math::wrap_pi(std::atan2(to.y(), to.x()) - heading_rad) : 0.0;
    if (distance_m_ < nearest_m_ - kNearer_m || reached_) {
      nearest_m_ = distance_m_;
      no_nearer_s_ = 0.0;
    } else {
      no_nearer_s_ += settings_.dt_s;
    }
  }
  /// Whether to walk on, and how long the steps are. Called at the end of a step, and while
  /// standing.
  void plan(const Style& style) {
    const double unit = std::max(style.step_length_m, 1e-3);
    length_ = 1.0;
    if (task_ == WalkTask::walk_to) {
      const bool begins = step_.standing();
      // the smallest steps do not carry their share: a character that has stopped this near stays
      const double near_enough = (begins && stopped_ ? 2.0 : 1.0) * settings_.goal_tolerance_m;
      if (distance_m_ <= near_enough) {
        walk_ = false;
        reached_ = begins;
        length_ = kShortestStep;
      } else {
        // opening and closing of a walk that begins now, or closing alone
        const double ends = (begins ? 2.0 : 1.0) * style.closing;
        const double aside = std::abs(aside_rad_), far = distance_m_ / unit;
        const double ahead = far * std::cos(std::min(aside, kAside));
        const double whole = std::max(0.0, std::ceil(ahead - ends - 1e-9));
        // a near goal is turned to first
        const double near = std::clamp(far / kNear, 0.3, 1.0);
        const double share = (aside / near - kAhead) / (kAside - kAhead);
        const bool faced =
            aside < kAside && distance_m_ * std::sin(aside) < kMiss * settings_.goal_tolerance_m;
        walk_ = begins || whole > 0.0 || !faced;
        length_ = std::clamp(ahead / (whole + ends), kShortestStep, 1.0);
        if (!faced) length_ *= 1.0 - (1.0 - kTurningStep) * std::clamp(share, 0.0, 1.0);
        reached_ = false;
      }
    }
    if (gait_.step_length_m) {
      length_ = std::clamp(*gait_.step_length_m / unit, 0.0, settings_.longest_step);
    }
  }
  double wished_turn(double heading_rad) const {
    double aside = math::wrap_pi(heading_rad_ - heading_rad);
    if (gait_.heading_rad) {
      aside = math::wrap_pi(*gait_.heading_rad - heading_rad);
    } else if (task_ == WalkTask::walk_to) {
      if (distance_m_ < settings_.goal_tolerance_m) return 0.0;  // its direction says nothing
      aside = aside_rad_;
    }
    const double pull =
        std::abs(aside) > 0.5 * std::numbers::pi ? std::copysign(1.0, aside) : std::sin(aside);
    return std::clamp(settings_.turn_gain_1_s * pull, -settings_.turn_max_rad_s,
                      settings_.turn_max_rad_s);
  }
  /// β, and the part of the turn that the motions do not make.
  void mix(const Style& style) {
    std::ranges::fill(beta_, 0.0);
    const auto add = [this](int motion, double share) {
      beta_[static_cast<std::size_t>(motion)] += share;
    };
    const double moving = step_.share() * length_follower_.value();
    const double cycle_s = math::kTwoPi / std::max(frequency_.value(), 0.1);
    const double wished = turn_.value() * cycle_s;  // rad a cycle
    double turned = moving * style.turn_rad;
    const auto shares = style_.shares();
    for (int s = 0; s < repertoire_->style_count(); ++s) {
      const double share = shares[static_cast<std::size_t>(s)];
      if (share == 0.0) continue;
      const StyleMotions& motions = repertoire_->style(s);
      const int turning = wished > 0.0 ? motions.left : motions.right;
      double curve = 0.0;
      if (turning >= 0 && turning != motions.straight) {
        const double more =
            repertoire_->motion(turning).turn_rad - repertoire_->motion(motions.straight).turn_rad;
        curve = more * wished > 0.0 ? std::min(wished / more, 1.0) : 0.0;
        turned += moving * share * curve * more;
        add(turning, share * moving * curve);
      }
      add(motions.straight, share * moving * (1.0 - curve));
      add(motions.standing, share * (1.0 - moving));
    }
    pivot_rad_s_ = step_.share() * std::clamp((wished - turned) / cycle_s,
                                              -settings_.turn_max_rad_s, settings_.turn_max_rad_s);
    blending_ = !std::ranges::equal(beta_, last_beta_, [](double a, double b) {
      return (a == 0.0) == (b == 0.0) && std::abs(a - b) < kSameShare;
    });
    if (blending_) std::ranges::copy(beta_, last_beta_.begin());
  }

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
