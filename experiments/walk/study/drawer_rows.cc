#include "experiments/walk/study/drawer_rows.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::walk {

Spread spread_of(const std::vector<double>& values) {
  if (values.empty()) return {};
  if (std::ranges::any_of(values, [](double v) { return std::isnan(v); })) {
    const double none = std::nan("");
    return {none, none, none, none};
  }
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

double largest(const std::vector<Outcome>& outcomes, double (*value)(const Outcome&)) {
  std::vector<double> sizes;
  for (const Outcome& o : outcomes) sizes.push_back(std::abs(value(o)));
  return spread_of(sizes).most;
}

std::vector<Outcome> speed_class(const std::vector<Outcome>& thirty, std::size_t number) {
  MIMESIS_ASSERT(thirty.size() == 30 && number < kSpeeds.size());
  const auto first = thirty.begin() + static_cast<std::ptrdiff_t>(10 * number);
  return {first, first + 10};
}

int falls(const std::vector<Outcome>& outcomes) {
  return static_cast<int>(std::ranges::count_if(outcomes, &Outcome::fell));
}

std::string bars_panel(const std::vector<Bar>& bars, const std::string& name, double most,
                       double infeasible, std::vector<plot::Data>& data) {
  std::string tics, curves;
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const Bar& b = bars[i];
    const auto x = static_cast<double>(i);
    const std::string block = name + std::to_string(i);
    const auto cut = [&](double v) { return most > 0.0 ? std::min(v, most) : v; };
    data.push_back({block,
                    {{x, cut(b.spread.mean), cut(b.spread.mean - b.spread.std),
                      cut(b.spread.mean + b.spread.std), b.spread.least, cut(b.spread.most)}}});
    tics += (i ? ", " : "") + plot::quoted(b.label) + " " + std::to_string(i);
    curves += ", $" + block +
              " using 1:2:5:6 with yerrorbars lc rgb '#c8371e' lw 1.2 pt 0 notitle" + ", $" +
              block + " using 1:2:3:4 with yerrorbars lt " + std::to_string(b.colour) +
              " pt 7 ps 1 notitle";
  }
  std::string script = "set xrange [-0.6:" + std::to_string(bars.size() - 1) +
                       ".6]\nset yrange [0:" + (most > 0.0 ? std::to_string(most) : "*") +
                       "]\nset xtics (" + tics + ") rotate by -35\n";
  if (infeasible > 0.0) {
    script += "set object 1 rectangle from graph 0, first " + std::to_string(infeasible) +
              " to graph 1, graph 1 fillcolor rgb '#f3b0a5' fillstyle solid 0.5 noborder behind\n";
  }
  return script + "plot -1 notitle" + curves + "\n";
}

}  // namespace mimesis::walk
