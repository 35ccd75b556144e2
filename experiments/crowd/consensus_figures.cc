// Headings agree through their common mean: quorum sensing [M18 4.4.2, 5; eq. 4.33].
#include <random>
#include <string>

#include "common/math/circle.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"
#include "experiments/harness/statistics.h"
#include "nodes/crowd/certificate/rate_fit.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;
using math::kTwoPi;

constexpr int kAgents = 12;
constexpr double kTurnStep_s = 0.02;

/// Headings anywhere. No common step cycle: every agent has its own frequency, within ±`uneven`.
struct Walkers {
  HeadingRule rule;
  double uneven = 0.0;

  Crowd start(std::mt19937_64& draw) const {
    const std::vector<double> headings = uniform(kAgents, -0.5 * kTwoPi, 0.5 * kTwoPi, draw);
    std::vector<Agent> agents(kAgents);
    for (int i = 0; i < kAgents; ++i) {
      Agent& a = agents[std::size_t(i)];
      a.id = static_cast<AgentId>(i + 1);
      a.state.position_W_m << 0.8 * (i % 4), 0.8 * (i / 4);
      a.state.heading_rad = headings[std::size_t(i)];
      a.traits.omega_rad_s = kOmega_rad_s * (1.0 + uneven * (2.0 * i / (kAgents - 1) - 1.0));
    }
    return one_group({Rules{.heading = rule}, gait_of(0.0), {}}, agents, kTurnStep_s);
  }
};

struct Agreement {
  double share = 0.0;     ///< share of 500 starts that agree
  double rate_1_s = 0.0;  ///< median of the first 60
};

Agreement agree(const Walkers& group) {
  constexpr int kStarts = 500, kRated = 60;
  std::mt19937_64 draw(23);
  std::vector<double> rates;
  int agreed = 0;
  for (int s = 0; s < kStarts; ++s) {
    Crowd crowd = group.start(draw);
    RateFit fit(1e-6, 3e-2);
    const double end = s < kRated ? 1e-6 : 1e-3;
    double r = 1.0;
    while (crowd.time_s() < 60.0 && r > end) {
      r = dispersion(crowd.heading_rad());
      fit.add(crowd.time_s(), r);
      crowd.step();
    }
    agreed += r <= 1e-3;
    if (s >= kRated) continue;
    if (const auto rate = fit.rate_1_s()) rates.push_back(*rate);
  }
  return {double(agreed) / kStarts, median(rates)};
}

/// Rows: t, then ψᵢ (unwrapped), then x, y of every agent, then the mean heading.
Data course(const std::string& name, const Walkers& group, double seconds) {
  std::mt19937_64 draw(29);
  Crowd crowd = group.start(draw);
  Data out{name, {}};
  for (int n = 0; crowd.time_s() < seconds; ++n, crowd.step()) {
    if (n % 3 != 0) continue;
    std::vector<double> row{crowd.time_s()};
    for (const double h : crowd.heading_rad()) row.push_back(math::wrap_pi(h));
    for (std::size_t i = 0; i < kAgents; ++i) {
      row.insert(row.end(), {crowd.x_m()[i], crowd.y_m()[i]});
    }
    row.push_back(circular_sum(crowd.heading_rad()).angle());
    out.rows.push_back(row);
  }
  return out;
}

Report consensus(const PlotDir& dir) {
  const Walkers direct{{.kind = HeadingKind::consensus, .gain = 0.2}, 0.0};
  Walkers filtered = direct, uneven = direct;
  filtered.rule.low_pass_s = 0.8;
  uneven.uneven = uneven.rule.low_pass_s = 0.15;
  Report report;
  const double rate = direct.rule.gain * kOmega_rad_s;
  const auto rows = [&](const std::string& name, const Walkers& group, bool rated) {
    const Agreement seen = agree(group);
    report.near(name + ": share of 500 starts that agree", seen.share, goal(1.0), 0.0, "1");
    if (rated) {
      report.near(name + ": rate", seen.rate_1_s, closed_form(rate, "m_ψ ω"), 0.01 * rate, "1/s");
    }
  };
  rows("mean heading", direct, true);
  rows("behind a low-pass of 0.8 s", filtered, true);
  rows("low-pass of 0.15 s, frequencies ± 15 %", uneven, false);
  if (dir) {
    report.plots.push_back(*dir / "consensus.png");
    const auto angles = [](const std::string& name) {
      std::string s = "plot ";
      for (int i = 0; i < kAgents; ++i) {
        s += "$" + name + " using 1:" + std::to_string(i + 2) + " with points pt 7 ps 0.2 lc " +
             std::to_string(i % 6 + 1) + " notitle, ";
      }
      return s + "$" + name + " using 1:" + std::to_string(3 * kAgents + 2) +
             " with lines lw 2 lc 8 dt 2 title 'mean'\n";
    };
    std::string paths = "plot ";
    for (int i = 0; i < kAgents; ++i) {
      const int column = kAgents + 2 + 2 * i;
      paths += std::string(i ? ", " : "") + "$direct using " + std::to_string(column) + ":" +
               std::to_string(column + 1) + " with lines lw 1.5 lc " + std::to_string(i % 6 + 1) +
               " notitle";
    }
    plot::plot_png(
        report.plots.back(), 1200, 430,
        {course("direct", direct, 6.0), course("filtered", filtered, 6.0)},
        "set multiplot layout 1,3 title 'Twelve agents agree on a heading (quorum sensing)'\n"
        "set grid\nset xlabel 'time [s]'\nset ylabel 'heading [rad]'\nset xrange [0:6]\n"
        "set yrange [-3.3:3.3]\nset title 'a) to the mean heading'\n" +
            angles("direct") + "set title 'b) behind a low-pass of 0.8 s'\n" + angles("filtered") +
            "set title 'c) paths of a)'\nset size ratio -1\nset xlabel 'x [m]'\n"
            "set ylabel 'y [m]'\nset autoscale\n" +
            paths + "\nunset multiplot");
  }
  return report;
}

}  // namespace

void add_consensus_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("consensus", "headings agree by quorum sensing", "M18",
                  Declared{.closed_form = 2, .goal = 3}, consensus);
}

}  // namespace mimesis::crowd
