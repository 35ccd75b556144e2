// Rule I behind a low-pass. [M10] filters without normalising, ż = −α z + G and φ̇ = −m L z, and has
// the bound α > √(m g_max λ_max). Rule I's filter has gain one: its m_d is m / α, its bound
// α > m_d g_max λ_max.
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <string>

#include "common/math/circle.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/frequency_runs.h"
#include "experiments/crowd/oscillators.h"
#include "nodes/crowd/certificate/contraction.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using reproduce::near;
using reproduce::Report;
using PlotDir = std::optional<std::filesystem::path>;

constexpr double kDt_s = 0.01, kUntil_s = 80.0;
constexpr double kFactors[] = {0.05, 0.1, 0.25, 1.0, 2.0};

struct Case {
  Topology topology;
  int n;
  double amplitude;  ///< amplitude of g
};

double most_lambda(const Case& c) { return extremes(c.topology, c.n).most; }

/// m ⟨g⟩ [1/s²] with which the fastest mode swings at √(m⟨g⟩λ_max) = ω, half as fast as g: behind a
/// slow low-pass the gait pumps it.
double gain_of(const Case& c) { return kOmega_rad_s * kOmega_rad_s / most_lambda(c); }

double bound_of(const Case& c) {
  return std::sqrt(gain_of(c) * (1.0 + c.amplitude) * most_lambda(c));
}

FrequencyRun make(const Case& c, double alpha) {
  FrequencyRun run{CouplingGraph::make(c.topology, c.n),
                   {.gain_rad_m_s = gain_of(c) / kMean_m_rad / alpha, .low_pass_rad_s = alpha},
                   gait_of(kMean_m_rad, c.amplitude),
                   kOmega_rad_s,
                   {}};
  for (int i = 0; i < c.n; ++i) run.place_m.push_back(-i * math::kTwoPi * kMean_m_rad);
  return run;
}

FrequencyRun::State start(const FrequencyRun& run, std::mt19937_64& draw) {
  std::uniform_real_distribution<double> uniform(0.0, math::kTwoPi);
  std::vector<double> phi;
  for (std::size_t i = 0; i < run.place_m.size(); ++i) phi.push_back(uniform(draw));
  return run.tied(phi);
}

struct Seen {
  double share = 0.0;   ///< share of starts whose error has fallen to a thousandth
  double time_s = 0.0;  ///< mean time until then, of those that have
};

Seen formed(const Case& c, double factor) {
  const FrequencyRun run = make(c, factor * bound_of(c));
  std::mt19937_64 draw(17);
  constexpr int kStarts = 6;
  Seen seen;
  int count = 0;
  for (int s = 0; s < kStarts; ++s) {
    FrequencyRun::State x = start(run, draw);
    const double first = run.error_m(x);
    bool done = false;
    for (double t = 1.0; t <= kUntil_s && !done; t += 1.0) {
      double most = 0.0;  // over a second, as the error swings through zero
      for (int n = 0; n < 100; ++n) {
        run.step(x, kDt_s);
        most = std::max(most, run.error_m(x));
      }
      done = most < 1e-3 * first;
      if (done) seen.time_s += t;
    }
    count += done;
  }
  seen.share = double(count) / kStarts;
  seen.time_s = count ? seen.time_s / count : std::nan("");
  return seen;
}

Report low_pass(const PlotDir& dir) {
  Report report;
  const auto name_of = [](const Case& c) {
    std::ostringstream s;
    s << to_string(c.topology) << " of " << c.n << ", g ± " << 100.0 * c.amplitude << " %: ";
    return s.str();
  };
  const auto share = [&](const Case& c, double factor, double expected) {
    std::ostringstream what;
    what << name_of(c) << "α = " << factor << " × bound: share in formation within 80 s";
    const Seen seen = formed(c, factor);
    report.rows.push_back(near(what.str(), seen.share, expected, 0.0, "1"));
    return seen;
  };
  for (const Case& c : {Case{Topology::all_to_all, 5, 0.8},
                        {Topology::all_to_all, 8, 0.3},
                        {Topology::ring, 8, 0.8},
                        {Topology::ring, 10, 0.3}}) {
    share(c, 0.05, 0.0);
    share(c, 0.1, 0.0);
    if (c.topology == Topology::all_to_all && c.amplitude > 0.5) share(c, 0.25, 0.0);
    const Seen at_bound = share(c, 1.0, 1.0), above = share(c, 2.0, 1.0);
    report.rows.push_back(reproduce::at_least(
        name_of(c) + "time at 2 × bound / time at the bound", above.time_s / at_bound.time_s, 1.0,
        "1", "a weak filter is slow too, as m_d = m/α; nothing is printed"));
  }
  if (dir) {
    std::vector<Data> data;
    std::string curves;
    const Case shown{Topology::all_to_all, 5, 0.8};
    for (const double factor : kFactors) {
      const FrequencyRun run = make(shown, factor * bound_of(shown));
      std::mt19937_64 draw(17);
      FrequencyRun::State x = start(run, draw);
      Data d{"d" + std::to_string(data.size()), {}};
      const auto per_cycle = static_cast<int>(math::kTwoPi / kOmega_rad_s / kDt_s);
      for (double t = 0.0; t < kUntil_s;) {
        double most = 0.0;
        for (int n = 0; n < per_cycle; ++n, t += kDt_s) {
          run.step(x, kDt_s);
          most = std::max(most, run.error_m(x));
        }
        d.rows.push_back({t, most});
      }
      std::ostringstream title;
      title << "α = " << factor << " × bound";
      curves += (data.empty() ? "plot $" : ", $") + d.name + " with lines lw 1.8 lc " +
                std::to_string(data.size() + 1) + " title '" + title.str() + "'";
      data.push_back(std::move(d));
    }
    report.plots.push_back(*dir / "low-pass.png");
    plot::plot_png(report.plots.back(), 900, 500, data,
                   "set title 'Rule I behind a low-pass, all-to-all of 5, g ± 80 %; bound √(m "
                   "g_max λ_max)'\nset grid\nset logscale y\nset format y '%.0e'\n"
                   "set yrange [1e-5:3]\nset xlabel 'time [s]'\n"
                   "set ylabel 'largest formation error of a cycle [m]'\nset key outside right\n" +
                       curves);
  }
  return report;
}

}  // namespace

void add_low_pass_figures(std::vector<reproduce::Figure>& to) {
  to.push_back({"low-pass", "spacing control behind a low-pass, above and below its bound", "M10",
                low_pass});
}

}  // namespace mimesis::crowd
