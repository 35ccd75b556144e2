#pragma once
#include "nodes/synthesizer/drawer/trial_generator.h"

namespace mimesis::synthesizer {

/// When things happen in one generated trial [s]; action 1 starts at 0.
struct TrialTimes {
  double t1, t2, t3;                 ///< durations of the actions
  double right_strike, left_strike;  ///< of action 2
  double reached, done;              ///< ends of actions 2 and 3
  explicit TrialTimes(const TrialPlan& p)
      : t1(p.duration_s[0]),
        t2(p.duration_s[1]),
        t3(p.duration_s[2]),
        right_strike(t1 + 0.42 * t2),
        left_strike(t1 + 0.86 * t2),
        reached(t1 + t2),
        done(t1 + t2 + t3) {}
};

/// Where one foot stands in the cycle before, in action 1 and in action 2; the last print stays.
std::vector<Footprint> prints_of(mocap::Side side, const TrialPlan& plan, const TrialTimes& times);

}  // namespace mimesis::synthesizer
