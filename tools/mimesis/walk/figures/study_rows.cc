#include "tools/mimesis/walk/figures/study_rows.h"

#include <algorithm>
#include <cmath>

namespace mimesis::walk {

Spread spread_of(const std::vector<double>& values) {
  if (values.empty()) return {};
  const auto n = static_cast<double>(values.size());
  Spread s;
  const auto [least, most] = std::ranges::minmax(values);
  s.least = least;
  s.most = most;
  for (const double v : values) s.mean += v / n;
  for (const double v : values) s.std += (v - s.mean) * (v - s.mean) / n;
  s.std = std::sqrt(s.std);
  return s;
}

int falls(const std::vector<Outcome>& outcomes, std::size_t from, std::size_t to) {
  int out = 0;
  for (std::size_t i = from; i < std::min(to, outcomes.size()); ++i) out += outcomes[i].fell;
  return out;
}

std::string bars_panel(const std::vector<Bar>& bars, const std::string& name, double most,
                       double infeasible, std::vector<reproduce::Data>& data) {
  std::string tics, curves;
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const Bar& b = bars[i];
    const auto x = static_cast<double>(i);
    const std::string block = name + std::to_string(i);
    const auto cut = [&](double v) { return std::min(v, most); };
    data.push_back({block,
                    {{x, cut(b.spread.mean), cut(b.spread.mean - b.spread.std),
                      cut(b.spread.mean + b.spread.std), b.spread.least, cut(b.spread.most)}}});
    tics += (i ? ", " : "") + reproduce::quoted(b.label) + " " + std::to_string(i);
    curves += ", $" + block +
              " using 1:2:5:6 with yerrorbars lc rgb '#c8371e' lw 1.2 pt 0 notitle" + ", $" +
              block + " using 1:2:3:4 with yerrorbars lt " + std::to_string(b.colour) +
              " pt 7 ps 1 notitle";
  }
  std::string script = "set xrange [-0.6:" + std::to_string(bars.size() - 1) +
                       ".6]\nset yrange [0:" + std::to_string(most) + "]\nset xtics (" + tics +
                       ") rotate by -35\n";
  if (infeasible > 0.0) {
    script += "set object 1 rectangle from graph 0, first " + std::to_string(infeasible) +
              " to graph 1, graph 1 fillcolor rgb '#f3b0a5' fillstyle solid 0.5 noborder behind\n";
  }
  return script + "plot -1 notitle" + curves + "\n";
}

}  // namespace mimesis::walk
