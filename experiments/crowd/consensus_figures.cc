// Headings agree through their common mean: quorum sensing [M18 4.4.2, 5; eq. 4.33].
#include <random>
#include <string>

#include "common/math/circle.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"
#include "experiments/harness/statistics.h"
#include "nodes/crowd/certificate/rate_fit.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

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

Report consensus(const PlotDir&) {
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
  return report;
}

}  // namespace

void add_consensus_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("consensus", "headings agree by quorum sensing", "M18",
                  Declared{.closed_form = 2, .goal = 3}, consensus);
}

}  // namespace mimesis::crowd
