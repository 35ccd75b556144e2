// Rates of synchronisation of Andronov-Hopf networks, measured and promised [M18 4.3.4-4.3.6].
// They are coupled by their states (eq. 4.24), the engine's agents by phases: an integrator of
// their own.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>
#include <string>

#include "common/plot/gnuplot.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/hopf_trials.h"
#include "experiments/crowd/oscillators.h"
#include "experiments/harness/statistics.h"
#include "nodes/crowd/certificate/rate_fit.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;

constexpr std::array kGraphs{Topology::star, Topology::chain, Topology::ring, Topology::all_to_all};
constexpr int kLeastN = 3, kMostN = 10;
constexpr double kCycle_s = 2.0 * std::numbers::pi / kOmega_rad_s;

std::string label(Topology t) {
  return t == Topology::all_to_all ? "all-to-all" : std::string(to_string(t));
}

double second_eigenvalue(Topology topology, int n) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
      CouplingGraph::make(topology, n).laplacian());
  return solver.eigenvalues()[1];
}

/// "$a using 1:2 with ..., ..." of all graphs.
std::string all_graphs(const std::string& prefix, const std::string& with,
                       const std::string& how = "") {
  std::ostringstream s;
  for (std::size_t g = 0; g < kGraphs.size(); ++g) {
    s << (g ? ", $" : "$") << prefix << g << ' ' << with << " ls " << g + 1 << how << " title '"
      << label(kGraphs[g]) << "'";
  }
  return s.str();
}

struct Ratio {
  int n;
  double promised, ratio;  // kλ⁺ and measured / kλ⁺
};

/// Median measured rate over kλ⁺ for all N.
std::vector<Ratio> ratios(Topology topology, double promised) {
  std::vector<Ratio> out;
  for (int n = kLeastN; n <= kMostN; ++n) {
    const double k = promised / printed_lambda(topology, n);
    const HopfOutcome o = run({.topology = topology,
                               .n = n,
                               .k_1_s = k,
                               .until_s = 10.0 + 24.0 / promised,
                               .omega_rad_s = kOmega_rad_s});
    out.push_back({n, promised, median(o.rate_1_s) / promised});
  }
  return out;
}

Report table(const PlotDir&) {
  Report report;
  for (const Topology graph : kGraphs) {
    const std::string name = label(graph);
    double off = 0.0;
    for (int n = kLeastN; n <= kMostN; ++n) {
      off = std::max(off, std::abs(second_eigenvalue(graph, n) - printed_lambda(graph, n)));
    }
    report.near(name + ": λ⁺ of the table - eigenvalue, largest for N = 3 ... 10", off,
                published(0.0, "M18 table 4.1"), 1e-12, "1");
    for (const double promised : {0.3, 1.2, 2.0}) {
      const auto all = ratios(graph, promised);
      const auto worst =
          std::ranges::max_element(all, {}, [](const Ratio& r) { return std::abs(r.ratio - 1.0); });
      std::ostringstream what;
      what << name << ", kλ⁺ = " << promised << "/s: measured rate / kλ⁺, worst N (" << worst->n
           << ")";
      if (promised < 1.0) what << ", below the bound, of those that come into step";
      report.near(what.str(), worst->ratio, closed_form(1.0, "kλ⁺"), 0.01, "1");
    }
  }
  return report;
}

HopfOutcome five(Topology topology, double k, double until_s) {
  return run({.topology = topology,
              .n = 5,
              .k_1_s = k,
              .trials = 100,
              .until_s = until_s,
              .omega_rad_s = kOmega_rad_s,
              .sample_s = 0.02,
              .curve = true});
}

RateFit fit_of(const HopfOutcome& o, const std::vector<double>& r) {
  RateFit line(kLeastR, kMostR);
  for (std::size_t s = 0; s < r.size(); ++s) line.add(o.time_s[s], r[s]);
  return line;
}

std::vector<double> geometric_mean(const HopfOutcome& o) {
  std::vector<double> r;
  for (const double y : o.mean_log_r) r.push_back(std::exp(y));
  return r;
}

void decay_rows(Report& report) {
  constexpr double kStrength = 3.0;
  for (const Topology topology : kGraphs) {
    const HopfOutcome o = five(topology, kStrength, 20.0);
    const double promised = kStrength * printed_lambda(topology, 5) * kCycle_s;
    report.near(label(topology) + ", N = 5, k = 3/s: rate of the mean curve",
                fit_of(o, geometric_mean(o)).rate_1_s().value() * kCycle_s,
                closed_form(promised, "kλ⁺"), 0.01 * promised, "1/cycle");
  }
}

/// a) curves of all graphs at one k, with the fit.
void curve_panel(std::vector<Data>& data) {
  for (std::size_t g = 0; g < kGraphs.size(); ++g) {
    const HopfOutcome o = five(kGraphs[g], 1.0, 60.0);
    const std::vector<double> r = geometric_mean(o);
    const RateFit line = fit_of(o, r);
    Data curve{"a" + std::to_string(g), {}}, fit{"f" + std::to_string(g), {}};
    for (std::size_t s = 0; s < r.size() && r[s] > 0.5 * kLeastR; s += 4) {
      curve.rows.push_back({o.time_s[s] / kCycle_s, r[s], o.mean_r[s]});
    }
    for (const double level : {1.0, kLeastR}) {
      fit.rows.push_back({line.reaches_s(level).value() / kCycle_s, level});
    }
    data.push_back(std::move(curve));
    data.push_back(std::move(fit));
  }
}

/// b) offsets over k, of the mean of R as M18 takes it.
void offset_panel(Report& report, std::vector<Data>& data) {
  for (std::size_t g = 0; g < kGraphs.size(); ++g) {
    Data offsets{"b" + std::to_string(g), {}};
    for (const double k : {0.4, 0.6, 0.9, 1.3, 2.0, 3.0}) {
      const double rate = k * printed_lambda(kGraphs[g], 5);
      const HopfOutcome o = five(kGraphs[g], k, 10.0 + 20.0 / rate);
      offsets.rows.push_back({k, fit_of(o, o.mean_r).reaches_s(1.0).value() / kCycle_s});
    }
    // a chain loses its fast modes first, so its line crosses 1 before the start
    if (kGraphs[g] != Topology::chain) {
      report.at_least(
          label(kGraphs[g]) + ": offset at k = 0.4/s - at 3/s",
          offsets.rows.front()[1] - offsets.rows.back()[1], published(0.0, "M18 fig. 4.5"),
          "cycles",
          "the figure shows offsets that fall as the coupling grows; no numbers are printed");
    }
    data.push_back(std::move(offsets));
  }
}

Report decay(const PlotDir& dir) {
  Report report;
  std::vector<Data> data;
  decay_rows(report);
  curve_panel(data);
  offset_panel(report, data);
  if (dir) {
    report.plots.push_back(*dir / "fig-4.5.png");
    plot::plot_png(
        report.plots.back(), 1100, 460, data,
        "set multiplot layout 1,2 title 'Five Andronov-Hopf oscillators from 100 random starts'\n"
        "set grid\nset xlabel 'time [gait cycles]'\nset ylabel 'dispersion R'\nset logscale y\n"
        "set format y '%.0e'\nset yrange [1e-6:2]\nset xrange [0:40]\n"
        "set title 'a) mean over starts, k = 1/s; dashed: fits'\nset key top right\nplot " +
            all_graphs("a", "using 1:2 with lines") + ", " +
            [] {
              std::string s;
              for (std::size_t g = 0; g < kGraphs.size(); ++g) {
                s += std::string(g ? ", " : "") + "$f" + std::to_string(g) +
                     " with lines lw 1 dt 2 lc rgb '#404040' notitle";
              }
              return s;
            }() +
            "\nunset logscale y\nset format y '%g'\nset autoscale y\nset xrange [0.3:3.1]\n"
            "set xlabel 'coupling strength k [1/s]'\nset ylabel 'offset [gait cycles]'\n"
            "set title 'b) offset: where the fit to the mean R crosses 1'\nplot " +
            all_graphs("b", "using 1:2 with linespoints", " pt 7") + "\nunset multiplot");
  }
  return report;
}

/// Rates of three oscillators over k, and dλ/dk over N.
Data rates_over_k(const std::string& name, Topology topology, int n) {
  Data out{name, {}};
  for (const double promised : {1.1, 1.4, 1.7, 2.0, 2.3}) {
    const double k = promised / printed_lambda(topology, n);
    const HopfOutcome o =
        run({.topology = topology, .n = n, .k_1_s = k, .trials = 40, .omega_rad_s = kOmega_rad_s});
    out.rows.push_back({k, median(o.rate_1_s)});
  }
  return out;
}

Report rates(const PlotDir& dir) {
  Report report;
  std::vector<Data> data;
  for (std::size_t g = 0; g < kGraphs.size(); ++g) {
    data.push_back(rates_over_k("a" + std::to_string(g), kGraphs[g], 3));
    Data measured{"b" + std::to_string(g), {}}, theory{"t" + std::to_string(g), {}};
    double worst = 1.0;
    for (int n = kLeastN; n <= kMostN; ++n) {
      const double lambda = printed_lambda(kGraphs[g], n);
      measured.rows.push_back({double(n), slope(rates_over_k("", kGraphs[g], n).rows)});
      theory.rows.push_back({double(n), lambda});
      const double ratio = measured.rows.back()[1] / lambda;
      if (std::abs(ratio - 1.0) > std::abs(worst - 1.0)) worst = ratio;
    }
    report.near(label(kGraphs[g]) + ", N = 3: slope of rate over k", slope(data.back().rows),
                closed_form(printed_lambda(kGraphs[g], 3), "λ⁺"),
                0.01 * printed_lambda(kGraphs[g], 3), "1");
    report.near(label(kGraphs[g]) + ": slope / λ⁺, worst of N = 3 ... 10", worst,
                closed_form(1.0, "λ⁺"), 0.01, "1");
    data.push_back(std::move(measured));
    data.push_back(std::move(theory));
  }
  if (dir) {
    report.plots.push_back(*dir / "fig-4.6.png");
    std::string theory;
    for (std::size_t g = 0; g < kGraphs.size(); ++g) {
      theory += ", $t" + std::to_string(g) + " with lines dt 2 lw 1.5 lc " + std::to_string(g + 1) +
                " notitle";
    }
    plot::plot_png(
        report.plots.back(), 1100, 460, data,
        "set multiplot layout 1,2 title 'Rate of synchronisation and coupling strength'\nset grid\n"
        "set key bottom right\nset xlabel 'coupling strength k [1/s]'\nset ylabel 'rate [1/s]'\n"
        "set title 'a) three oscillators (chain = star, ring = all-to-all)'\n"
        "set xrange [0:2.5]\nset yrange [0:2.6]\nplot x with lines lw 1 dt 2 lc rgb '#404040' "
        "title 'kλ⁺', 3*x with lines lw 1 dt 2 lc rgb '#404040' notitle, "
        "$a0 with points ls 1 pt 6 ps 1.8 title 'star', $a1 with points ls 2 pt 7 ps 0.9 title "
        "'chain', $a2 with points ls 3 pt 4 ps 1.8 title 'ring', $a3 with points ls 4 pt 5 "
        "ps 0.9 title 'all-to-all'\n"
        "set title 'b) slope dλ/dk; dashed: λ⁺'\nset xlabel 'oscillators N'\nset key top left\n"
        "set ylabel 'slope [1]'\nset xrange [2.5:10.5]\nset yrange [0:10.5]\nplot " +
            all_graphs("b", "with points", " pt 3 ps 1.4") + theory + "\nunset multiplot");
  }
  return report;
}

}  // namespace

void add_rate_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("table-4.1", "rates of synchronisation of four coupling graphs against kλ⁺",
                  "M18", Declared{.published = 4, .closed_form = 12}, table);
  to.emplace_back("fig-4.5", "dispersion over time, and the offset before its decay", "M18",
                  Declared{.published = 3, .closed_form = 4}, decay);
  to.emplace_back("fig-4.6", "measured rates over coupling strength and size of the group", "M18",
                  Declared{.closed_form = 8}, rates);
}

}  // namespace mimesis::crowd
