#pragma once
#include <string>
#include <vector>

#include "experiments/motion/styles.h"

namespace mimesis::synthesizer {

/// How styles are changed when jerk is measured.
struct BlendingCase {
  double beta = 0.2;        ///< half width of the interval, in units of π
  bool least_jerk = false;  ///< LeastJerkTransition instead of eq. 3.23
  bool cut = false;         ///< no transition at all: the next style from φ = 0 on
};

/// The jerk of a transition relative to that of the two styles by themselves.
///
/// Numerator: rms of the third differences at 60 Hz, over all rows, in the 0.4 s around φ = 0.
/// Denominator of `ratio`, the one that goals are held to: the same of both styles in the same
/// place, rms over the two. A half-way share of both is what a blend consists of; and a heel
/// strike, which is at φ = 0 in gait, is in both. It gives less than 1 for a transition that is
/// smoother than the two styles, exactly 1 between equal styles. The others: `of_cycle` takes the
/// steady styles' whole cycles, which hides what is special to φ = 0; `of_larger` the larger of the
/// two styles in the same place, which lets a rough style excuse the change to a smooth one.
///
/// Everything is rms over 4 positions of the frames between each other: with some 25 frames the
/// single ratio varies by a tenth.
struct BlendingJerk {
  std::string from, to;
  double ratio = 0.0, of_cycle = 0.0, of_larger = 0.0;
  double jerk_rad_s3 = 0.0;  ///< the numerator
};

/// All ordered pairs of two different styles, in the order of `styles`.
std::vector<BlendingJerk> blending_jerk(const motion::MotionModel& model, const Styles& styles,
                                        const BlendingCase& what);

/// Spread of one member over all pairs, e.g. &BlendingJerk::ratio.
struct Spread {
  double median = 0.0, worst = 0.0;
  std::size_t worst_pair = 0;
  int within = 0;  ///< pairs at or below the limit
};
Spread spread(const std::vector<BlendingJerk>& pairs, double BlendingJerk::*of, double limit);

}  // namespace mimesis::synthesizer
