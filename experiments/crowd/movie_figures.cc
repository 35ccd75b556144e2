// Movies 1 to 5 of M18 4.3.5: three characters that meet or miss the bound k λ⁺ > 1.
#include <cmath>
#include <sstream>
#include <string>

#include "common/plot/gnuplot.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/hopf_trials.h"
#include "nodes/crowd/certificate/rate_fit.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;

struct Movie {
  int number;
  Topology topology;
  double k_1_s;
};
constexpr Movie kMovies[] = {{1, Topology::all_to_all, 0.334},
                             {2, Topology::all_to_all, 0.111},
                             {3, Topology::all_to_all, -2.0},
                             {4, Topology::chain, 1.0},
                             {5, Topology::chain, 0.333}};
constexpr double kSeen_s = 60.0;
constexpr double kGaitCycle_s = 2.0 * M_PI / 6.0;  // of HopfTrials

std::string label(const Movie& m) {
  std::ostringstream s;
  s << "movie " << m.number << ", " << to_string(m.topology) << ", k = " << m.k_1_s << "/s";
  return s.str();
}

Report movies(const PlotDir& dir) {
  Report report;
  std::vector<Data> data;
  std::ostringstream curves;
  for (const Movie& m : kMovies) {
    const HopfOutcome o = run({.topology = m.topology,
                               .n = 3,
                               .k_1_s = m.k_1_s,
                               .trials = 40,
                               .until_s = kSeen_s,
                               .curve = true});
    if (m.k_1_s > 0.0) {
      RateFit fit(kLeastR, kMostR);
      for (std::size_t s = 0; s < o.time_s.size(); ++s)
        fit.add(o.time_s[s], std::exp(o.mean_log_r[s]));
      const double rate = m.k_1_s * printed_lambda(m.topology, 3);
      report.near(label(m) + ": rate of the mean curve", fit.rate_1_s().value_or(std::nan("")),
                  closed_form(rate, "kλ⁺"), 0.01 * rate, "1/s");
    } else {
      report.near(label(m) + ": R in the end", o.mean_r.back(),
                  closed_form(1.0, "three phases a third of a cycle apart"), 0.01, "1",
                  "no coordinated pattern: phases repel each other");
    }
    const std::string name = "m" + std::to_string(m.number);
    Data curve{name, {}};
    for (std::size_t s = 0; s < o.time_s.size(); ++s)
      curve.rows.push_back({o.time_s[s] / kGaitCycle_s, std::exp(o.mean_log_r[s])});
    data.push_back(std::move(curve));
    curves << (m.number > 1 ? ", $" : "$") << name << " with lines title '" << label(m) << "'";
  }
  if (dir) {
    plot::plot_png(report.picture(*dir / "movies-1-5.png"), 820, 460, data,
                   "set title 'Three characters from 40 random starts'\nset key at graph "
                   "0.98,0.85\nset grid\nset logscale y\n"
                   "set xlabel 'time [gait cycles]'\nset ylabel 'dispersion R'\n"
                   "set format y '%.0e'\nset yrange [1e-6:2]\nplot " +
                       curves.str());
  }
  return report;
}

}  // namespace

void add_movie_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("movies-1-5", "three characters above, below and far below the bound kλ⁺ > 1",
                  "M18", Declared{.closed_form = 5}, movies);
}

}  // namespace mimesis::crowd
