#pragma once
#include "common/plot/gnuplot.h"
#include "experiments/walk/study/drawer_study.h"

namespace mimesis::walk {

/// Mean, standard deviation and range; NaN if a value is NaN.
struct Spread {
  double mean = 0.0, std = 0.0, least = 0.0, most = 0.0;
};
Spread spread_of(const std::vector<double>& values);

template <class Value>
std::vector<double> values_of(const std::vector<Outcome>& outcomes, const Value& value) {
  std::vector<double> out;
  for (const Outcome& o : outcomes) out.push_back(value(o));
  return out;
}
int falls(const std::vector<Outcome>& outcomes);
/// Largest absolute value; NaN if a walk has none, which no row accepts.
double largest(const std::vector<Outcome>& outcomes, double (*value)(const Outcome&));

/// Speed classes of novel_goals().
inline constexpr std::array kSpeeds = {"slow", "middle", "fast"};
/// Ten of thirty outcomes.
std::vector<Outcome> speed_class(const std::vector<Outcome>& thirty, std::size_t number);

/// Limits of HRP-2 [M18 3.8.4], and the largest error of steps and reaches.
inline constexpr double kMostNormal_n = 800.0, kMostError_m = 0.010;
/// The same with the senses of a lab, as asked of the hand at drawers.
inline constexpr double kMostWithSenses_m = 0.015;

inline double ankle(const Outcome& o) { return o.ankle_n_m; }
inline double normal_force(const Outcome& o) { return o.normal_n; }
inline double step_error(const Outcome& o) { return o.step_error_m; }
inline double normal_error(const Outcome& o) { return o.normal_error_m; }
inline double reaching_error(const Outcome& o) { return o.reaching_error_m; }
inline double reach_error(const Outcome& o) { return o.reach_error_m; }

/// One error bar: mean and standard deviation, and the range, as in [M18 fig. 3.46, 3.47].
struct Bar {
  std::string label;
  Spread spread;
  int colour = 1;  ///< line type
};
/// Makes a panel of bars with an axis from 0 to `most`, where longer ones are cut; 0: as long as
/// needed. Adds their data to `data` and returns the plot command. A positive `infeasible` shades
/// everything above it.
std::string bars_panel(const std::vector<Bar>& bars, const std::string& name, double most,
                       double infeasible, std::vector<plot::Data>& data);

}  // namespace mimesis::walk
