#pragma once
#include <chrono>
#include <deque>

#include "nodes/crowd/external/external_agents.h"
#include "nodes/crowd/rules/gait.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

/// Estimates the walker of the theory from a walking body. A pelvis sways, turns and hurries with
/// every step (walk.motion.json: 3.5 cm, 0.13 rad, 30 %), and its mean heading is not quite the way
/// it goes. Means over the last gait cycle, by the phase, are free of all that has its period; half
/// of the change over the cycle brings them to the present:
///   p = ⟨p⟩ + Δp/2 + W(φ) |Δp| / (2π ⟨g⟩),  ψ = ⟨ψ⟩ + Δψ/2 − β,  v = φ̇ g(φ) |Δp| / (2π ⟨g⟩),
/// W = ∫(g − ⟨g⟩) dφ without its mean, the sway of the theory's walker along its way; β is the
/// angle from the ways to the headings, learned in some cycles. Exact for steady walking. Where
/// less than a cycle is known, where steps become longer or shorter, and where a body stands,
/// shares of it: a body that rests, or begins, is where it is.
class PathFilter {
 public:
  using Time = std::chrono::nanoseconds;

  /// @param body  in the order of time; after an impossible speed or a long silence it starts again
  AgentReport step(const AgentReport& body, Time stamp, const SpeedFunction& gait);

  /// β: add it to the heading of a way for the body's [rad].
  double yaw_rad() const { return yaw_rad_; }
  /// |Δp|, two steps; 0 before a whole cycle is known.
  double cycle_m() const { return cycle_m_; }
  /// Share of a cycle that the last report added [1].
  double advance() const { return advance_; }

 private:
  struct Sample {
    double turned_rad;  // the phase, not wrapped
    Time stamp;
    Eigen::Vector2d p_W_m;
    double heading_rad;  // not wrapped
  };
  struct Mean {
    Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero(), moved_m = Eigen::Vector2d::Zero();
    double heading_rad = 0.0, turned_rad = 0.0;
    double range = 0.0;  // length of the averaged part, in cycles
    double share = 0.0;  // weight of the mean; the rest is the body's own state
  };
  Sample at(double turned_rad) const;
  void take(const AgentReport& body, Time stamp);
  Mean mean() const;

  std::deque<Sample> samples_;  // samples of the last cycle, and one before it
  double phase_rad_ = 0.0, yaw_rad_ = 0.0, cycle_m_ = 0.0, advance_ = 0.0;
  bool yaw_known_ = false;
};

/// Ratio of actual to requested length of steps: bodies have shares of movements, not metres. A
/// body follows requests late; learned in some cycles while both change little.
class StepGain {
 public:
  /// @param asked_m, walked_m  length of a step
  /// @param cycles  since the last call
  void learn(double asked_m, double walked_m, double cycles);
  double value() const { return value_; }  ///< within [0.8, 1.25]

 private:
  double value_ = 1.0, asked_late_m_ = 0.0, walked_smooth_m_ = 0.0;
};

/// Correction of the requested heading, so that the body's way has it: the integral of the error.
class HeadingTrim {
 public:
  /// @param asked_rad, walked_rad  headings of the way
  void learn(double asked_rad, double walked_rad, double cycles);
  double value_rad() const { return value_rad_; }  ///< within 0.2 either way

 private:
  double value_rad_ = 0.0;
};

/// Time in which a heading rule turns to its goal; infinity: it has none. A heading requested so
/// far ahead is the goal, independent of the estimate of the present one.
double settling_s(const HeadingRule& rule, double phase_rate_rad_s);

}  // namespace mimesis::crowd
