// Distances kept by the frequency of steps: rule I [M18 4.4.2, 2; fig. 4.11].
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <string>

#include "common/math/circle.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/frequency_runs.h"
#include "experiments/crowd/hopf_trials.h"
#include "experiments/crowd/statistics.h"
#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/certificate/rate_fit.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using reproduce::at_least;
using reproduce::at_most;
using reproduce::near;
using reproduce::Report;
using PlotDir = std::optional<std::filesystem::path>;

constexpr double kAmplitude = 0.3;  // g_min = 0.7 ⟨g⟩
constexpr double kFrequencyStep_s = 0.005, kMostError_rad = 3e-2;
const double kCycle_m = math::kTwoPi * kMean_m_rad;

FrequencyRun make(Topology topology, int n, double gain) {
  FrequencyRun run{CouplingGraph::make(topology, n),
                   {.gain_rad_m_s = gain},
                   gait_of(kMean_m_rad, kAmplitude),
                   6.0,
                   {}};
  for (int i = 0; i < n; ++i) run.place_m.push_back(-i * kCycle_m);  // one cycle apart
  return run;
}

std::vector<double> random_phases(int n, double width, std::mt19937_64& draw) {
  std::uniform_real_distribution<double> uniform(0.0, width);
  std::vector<double> phi;
  for (int i = 0; i < n; ++i) phi.push_back(uniform(draw));
  return phi;
}

/// Median rate of differences over random starts; < 0 where it grows.
double measured(Topology topology, int n, double gain, double seconds, double width) {
  const FrequencyRun run = make(topology, n, gain);
  std::mt19937_64 draw(5);
  std::vector<double> rates;
  for (int trial = 0; trial < 15; ++trial) {
    FrequencyRun::State x = run.tied(random_phases(n, width, draw));
    // late: growth when the fastest mode leads, decay when the slowest remains
    RateFit fit(1e-5, kMostError_rad);  // below, what RK4 does to z and to G(φ) differs
    for (double t = 0.0; t < seconds; t += kFrequencyStep_s) {
      const double error = FrequencyRun::phase_error_rad(x);
      if (gain < 0.0 && error > kMostError_rad) break;
      fit.add(t, error);
      run.step(x, kFrequencyStep_s);
    }
    if (const auto rate = fit.rate_1_s()) rates.push_back(*rate);
  }
  return median(rates);
}

/// Rows: t, then zᵢ − t ω ⟨g⟩ of all.
Data courses(const std::string& name, const FrequencyRun& run, FrequencyRun::State x,
             double seconds) {
  Data out{name, {}};
  for (double t = 0.0; t < seconds; t += kFrequencyStep_s) {
    if (out.rows.empty() || t - out.rows.back()[0] > 0.04) {
      std::vector<double> row{t};
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        row.push_back(x(i, 1) - t * run.omega_rad_s * kMean_m_rad);
      }
      out.rows.push_back(row);
    }
    run.step(x, kFrequencyStep_s);
  }
  return out;
}

std::string lines(const std::string& name, int n) {
  std::ostringstream s;
  for (int i = 0; i < n; ++i) {
    s << (i ? ", $" : "plot $") << name << " using 1:" << i + 2 << " with lines lw 1.6 lc "
      << i % 6 + 1 << " notitle";
  }
  return s.str();
}

/// Nine agents in three rows: places and phases that do not belong together.
FrequencyRun three_rows(double gain) {
  FrequencyRun run = make(Topology::all_to_all, 9, gain);
  for (int i = 0; i < 9; ++i) run.place_m[std::size_t(i)] = -1.5 * (i / 3);
  return run;
}

FrequencyRun::State scattered(const FrequencyRun& run) {
  std::mt19937_64 draw(3);
  FrequencyRun::State x = run.tied(random_phases(9, math::kTwoPi, draw));
  std::uniform_real_distribution<double> uniform(-2.5, 1.0);
  for (Eigen::Index i = 0; i < 9; ++i) x(i, 1) = uniform(draw);
  return x;
}

/// Largest error after the transient.
double residual(const FrequencyRun& run) {
  FrequencyRun::State x = scattered(run);
  double worst = 0.0;
  for (double t = 0.0; t < 40.0; t += kFrequencyStep_s) {
    if (t > 30.0) worst = std::max(worst, run.error_m(x));
    run.step(x, kFrequencyStep_s);
  }
  return worst;
}

Report rows_of_agents(const PlotDir& dir) {
  Report report;
  struct Case {
    Topology topology;
    int n;
    double gain;  // m_d ⟨g⟩ [1/s]
  };
  for (const Case& c : {Case{Topology::ring, 4, 0.5},
                        {Topology::star, 5, 0.5},
                        {Topology::chain, 5, 0.5},
                        {Topology::all_to_all, 5, 0.16}}) {
    const double lambda = printed_lambda(c.topology, c.n);
    const double rate =
        measured(c.topology, c.n, c.gain / kMean_m_rad, 16.0 / (c.gain * lambda), math::kTwoPi);
    std::ostringstream name;
    name << to_string(c.topology) << " of " << c.n << ", m_d⟨g⟩ = " << c.gain << "/s: ";
    const double expected = c.gain * lambda;
    report.rows.push_back(
        near(name.str() + "rate, m_d⟨g⟩λ⁺", rate, expected, 0.01 * expected, "1/s"));
    report.rows.push_back(at_least(name.str() + "rate / bound m_d g_min λ⁺",
                                   rate / (expected * (1.0 - kAmplitude)), 1.0, "1",
                                   "contraction guarantees the bound"));
  }
  const FrequencyRun good = three_rows(0.5);
  report.rows.push_back(at_most("three rows of phases of their own: error that stays",
                                residual(good), 2.0 * kAmplitude * kMean_m_rad, "m",
                                "places oscillate where phases differ [M18 4.4.2, 2]; G differs "
                                "from ⟨g⟩φ by ±a⟨g⟩/2"));
  if (dir) {
    report.plots.push_back(*dir / "fig-4.11.png");
    const FrequencyRun bad = three_rows(-0.5);
    plot::plot_png(
        report.plots.back(), 1100, 470,
        {courses("good", good, scattered(good), 12.0), courses("bad", bad, scattered(bad), 12.0)},
        "set multiplot layout 1,2 title 'Nine agents, three rows 1.5 m apart: places relative to "
        "the walk, by step frequency alone (all-to-all)'\nset grid\nset xlabel 'time [s]'\n"
        "set ylabel 'z - ω⟨g⟩t [m]'\nset xrange [0:12]\nset yrange [-5:3]\n"
        "set title 'a) m_d = 0.5 rad/(m s): an ordered formation'\n" +
            lines("good", 9) +
            "\nset yrange [-20:20]\nset xrange [0:6]\nset title 'b) m_d = -0.5 rad/(m s): "
            "unstable'\n" +
            lines("bad", 9) + "\nunset multiplot");
  }
  return report;
}

Report divergence(const PlotDir& dir) {
  Report report;
  std::vector<Data> data;
  std::string curves;
  for (const Topology topology : {Topology::all_to_all, Topology::ring, Topology::chain}) {
    const double lambda = extremes(topology, 5).most, gain = -0.5;
    const double expected = -gain * lambda, seconds = 14.0 / expected;
    const std::string name(to_string(topology));
    const double rate = measured(topology, 5, gain / kMean_m_rad, 26.0 / expected, 1e-10);
    report.rows.push_back(near(name + " of 5, m_d⟨g⟩ = -0.5/s: growth, |m_d|⟨g⟩λ_max", -rate,
                               expected, 0.01 * expected, "1/s"));
    const FrequencyRun run = make(topology, 5, gain / kMean_m_rad);
    std::mt19937_64 draw(9);
    FrequencyRun::State x = run.tied(random_phases(5, 1e-4, draw));
    Data d{"d" + std::to_string(data.size()), {}};
    for (double t = 0.0; t < seconds; t += kFrequencyStep_s) {
      d.rows.push_back({t, run.error_m(x), 3e-5 * std::exp(expected * t)});
      run.step(x, kFrequencyStep_s);
    }
    const std::string c = std::to_string(data.size() + 1);
    curves += (data.empty() ? "plot $" : ", $") + d.name + " using 1:2 with lines lc " + c +
              " title '" + name + "', $" + d.name + " using 1:3 with lines dt 2 lw 1 lc " + c +
              (data.empty() ? " title 'exp(|m_d|⟨g⟩λ_max t)'" : " notitle");
    data.push_back(std::move(d));
  }
  // with the other sign the agents of this start come together
  report.rows.push_back(near("all_to_all of 5, m_d⟨g⟩ = +0.5/s: rate, m_d⟨g⟩λ⁺",
                             measured(Topology::all_to_all, 5, 0.5 / kMean_m_rad, 8.0, 1.0), 2.5,
                             0.025, "1/s"));
  if (dir) {
    report.plots.push_back(*dir / "divergence.png");
    plot::plot_png(report.plots.back(), 760, 480, data,
                   "set title 'm_d < 0: the formation falls apart (five agents)'\nset grid\n"
                   "set logscale y\nset format y '%.0e'\nset xlabel 'time [s]'\n"
                   "set ylabel 'formation error [m]'\nset yrange [1e-5:100]\n"
                   "set key bottom right\n" +
                       curves);
  }
  return report;
}

}  // namespace

void add_frequency_figures(std::vector<reproduce::Figure>& to) {
  to.push_back({"fig-4.11", "row distances kept by step frequency, and lost where m_d < 0", "M18",
                rows_of_agents});
  to.push_back({"divergence", "growth of the formation error for m_d < 0", "M18", divergence});
}

}  // namespace mimesis::crowd
