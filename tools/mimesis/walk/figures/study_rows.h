#pragma once
#include "common/reproduce/gnuplot.h"
#include "tools/mimesis/walk/study/drawer_study.h"

namespace mimesis::walk {

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
int falls(const std::vector<Outcome>& outcomes, std::size_t from = 0, std::size_t to = 1000);

/// One error bar: mean and standard deviation, and the range, as in [M18 fig. 3.46, 3.47].
struct Bar {
  std::string label;
  Spread spread;
  int colour = 1;  ///< line type
};
/// A panel of them: `$bars`-like data are added; returns the plot command. What is above
/// `infeasible` is shaded if it is positive.
std::string bars_panel(const std::vector<Bar>& bars, const std::string& name, double most,
                       double infeasible, std::vector<reproduce::Data>& data);

}  // namespace mimesis::walk
