// Distances kept by the frequency of steps: rule I [M18 4.4.2, 2; fig. 4.11].
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <utility>

#include "common/math/circle.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/hopf_trials.h"
#include "experiments/harness/statistics.h"
#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/certificate/rate_fit.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;

constexpr double kAmplitude = 0.3;  // g_min = 0.7 ⟨g⟩
constexpr double kFrequencyStep_s = 0.005, kMostError_rad = 3e-2;

FrequencyRule rule_of(Topology topology, double gain) {
  return {.graph = {topology}, .gain_rad_m_s = gain};
}

/// Agents behind each other, one cycle apart, with phases in [0, width).
Crowd queue(Topology topology, int n, double gain, double width, std::mt19937_64& draw) {
  std::vector<double> place;
  for (int i = 0; i < n; ++i) place.push_back(-i * math::kTwoPi * kMean_m_rad);
  return tied_crowd(rule_of(topology, gain), gait_of(kAmplitude), place,
                    uniform(n, 0.0, width, draw), kFrequencyStep_s);
}

/// Median rate of differences over random starts; < 0 where it grows.
double measured(Topology topology, int n, double gain, double seconds, double width) {
  std::mt19937_64 draw(5);
  std::vector<double> rates;
  for (int trial = 0; trial < 15; ++trial) {
    // Phases: for tied agents they decay like places, without the swing of g in front. Late: growth
    // when the fastest mode leads, decay when the slowest remains.
    RateFit fit(1e-5, kMostError_rad);
    for (Crowd crowd = queue(topology, n, gain, width, draw); crowd.time_s() < seconds;
         crowd.step()) {
      const double error = spread(crowd.phase_rad());
      if (gain < 0.0 && error > kMostError_rad) break;
      fit.add(crowd.time_s(), error);
    }
    if (const auto rate = fit.rate_1_s()) rates.push_back(*rate);
  }
  return median(rates);
}

/// Rows: t, then zᵢ − t ω ⟨g⟩ of all.
Data courses(const std::string& name, Crowd crowd, double seconds) {
  Data out{name, {}};
  for (; crowd.time_s() < seconds; crowd.step()) {
    if (!out.rows.empty() && crowd.time_s() - out.rows.back()[0] <= 0.04) continue;
    std::vector<double> row{crowd.time_s()};
    for (const double z : crowd.x_m()) {
      row.push_back(z - crowd.time_s() * kOmega_rad_s * kMean_m_rad);
    }
    out.rows.push_back(row);
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
Crowd three_rows(double gain) {
  std::mt19937_64 draw(3);
  const std::vector<double> phases = uniform(9, 0.0, math::kTwoPi, draw);
  std::vector<Agent> agents(9);
  for (std::size_t i = 0; i < 9; ++i) {
    agents[i].id = i + 1;
    agents[i].state.phase_rad = phases[i];
    agents[i].state.position_W_m.x() = uniform(1, -2.5, 1.0, draw)[0];
    agents[i].traits.place_m = -1.5 * static_cast<double>(i / 3);
    agents[i].traits.omega_rad_s = kOmega_rad_s;
  }
  Rules rules;
  rules.frequency = rule_of(Topology::all_to_all, gain);
  return one_group({rules, gait_of(kAmplitude), {}}, agents, kFrequencyStep_s);
}

/// Largest formation error of the last two seconds, and the one that phases make: differences of
/// zᵢ − dᵢ obey ẏ = −m⟨g⟩N y + d/dt (a⟨g⟩/2) sin 2φᵢ [M18 4.4.2, 2], to first order in a.
std::pair<double, double> residual(Crowd crowd, double gain) {
  while (crowd.time_s() < 30.0) crowd.step();
  double worst = 0.0, expected = 0.0;
  for (; crowd.time_s() < 32.0; crowd.step()) worst = std::max(worst, formation_error_m(crowd));
  const double swing = 0.5 * kAmplitude * kMean_m_rad /
                       std::hypot(1.0, gain * kMean_m_rad * 9.0 / (2.0 * kOmega_rad_s));
  for (double t = 0.0; t < math::kTwoPi; t += 0.01) {
    double least = 1.0, most = -1.0;
    for (const double phi : crowd.phase_rad()) {
      least = std::min(least, std::sin(2.0 * phi + t));
      most = std::max(most, std::sin(2.0 * phi + t));
    }
    expected = std::max(expected, swing * (most - least));
  }
  return {worst, expected};
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
    report.near(name.str() + "rate", rate, closed_form(expected, "m_d⟨g⟩λ⁺"), 0.01 * expected,
                "1/s");
  }
  const auto [stays, expected] = residual(three_rows(0.5), 0.5);
  report.near("three rows of phases of their own: error that stays", stays,
              closed_form(expected, "first order in the swing of g"), 0.1 * expected, "m",
              "a swing of ± 30 %");
  if (dir) {
    report.plots.push_back(*dir / "fig-4.11.png");
    plot::plot_png(
        report.plots.back(), 1100, 470,
        {courses("good", three_rows(0.5), 12.0), courses("bad", three_rows(-0.5), 12.0)},
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

Report divergence(const PlotDir&) {
  Report report;
  for (const Topology topology : {Topology::all_to_all, Topology::ring, Topology::chain}) {
    const double lambda = extremes(topology, 5).most, gain = -0.5;
    const double expected = -gain * lambda;
    const std::string name(to_string(topology));
    const double rate = measured(topology, 5, gain / kMean_m_rad, 26.0 / expected, 1e-10);
    report.near(name + " of 5, m_d⟨g⟩ = -0.5/s: growth", -rate,
                closed_form(expected, "|m_d|⟨g⟩λ_max"), 0.01 * expected, "1/s");
  }
  // with the other sign the agents of this start come together
  report.near("all_to_all of 5, m_d⟨g⟩ = +0.5/s: rate",
              measured(Topology::all_to_all, 5, 0.5 / kMean_m_rad, 8.0, 1.0),
              closed_form(2.5, "m_d⟨g⟩λ⁺"), 0.025, "1/s");
  return report;
}

}  // namespace

void add_frequency_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-4.11", "row distances kept by step frequency, and lost where m_d < 0", "M18",
                  Declared{.closed_form = 5}, rows_of_agents);
  to.emplace_back("divergence", "growth of the formation error for m_d < 0", "M18",
                  Declared{.closed_form = 4}, divergence);
}

}  // namespace mimesis::crowd
