// Which ways to take differences on the circle synchronise from every start [M18 4.3.2].
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "common/math/circle.h"
#include "common/math/integrator.h"
#include "common/plot/gnuplot.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"
#include "experiments/crowd/hopf_trials.h"
#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

using plot::Data;
using namespace reproduce;
using Phases = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 32, 1>;
using math::kTwoPi;

constexpr int kStarts = 500;

/// Two phases, coupled both ways; one row per sample: t, φ₁, φ₂.
std::vector<std::vector<double>> pair(double phi1, double phi2, double k) {
  constexpr double kDt = 0.005;
  Rules rules;
  rules.phase = {{Topology::chain}, k};
  Crowd crowd = one_group(rules, std::array{phi1, phi2}, kDt);
  std::vector<std::vector<double>> rows;
  for (int n = 0; n <= 1600; ++n, crowd.step()) {
    rows.push_back({crowd.time_s(), crowd.phase_rad()[0], crowd.phase_rad()[1]});
  }
  return rows;
}

constexpr double kInStep = 0.05;  // difference below which a pair walks in step [rad]

double time_in_step(const std::vector<std::vector<double>>& rows) {
  for (const auto& r : rows) {
    if (std::abs(r[1] - r[2]) < kInStep) return r[0];
  }
  return std::nan("");
}

Report pairs(const PlotDir& dir) {
  constexpr double kK = 0.4;
  const double from[2][2] = {{0.5, 3.2}, {2.6, 1.7}};
  Report report;
  std::vector<Data> data;
  for (int p = 0; p < 2; ++p) {
    const auto rows = pair(from[p][0], from[p][1], kK);
    const double apart = from[p][1] - from[p][0];
    double worst = 0.0;
    for (const auto& r : rows) {
      worst = std::max(worst, std::abs(r[2] - r[1] - apart * std::exp(-2.0 * kK * r[0])));
    }
    const std::string name = "pair " + std::to_string(p + 1);
    report.near(name + ": difference - Δφ₀ exp(−2kt), largest", worst,
                closed_form(0.0, "Δφ₀ exp(−2kt)"), 1e-4, "rad",
                "steps of 5 ms, the first one Euler's");
    report.near(name + ": in step (0.05 rad) after", time_in_step(rows),
                closed_form(std::log(std::abs(apart) / kInStep) / (2.0 * kK), "Δφ₀ exp(−2kt)"),
                0.02, "s");
    data.push_back({"pair" + std::to_string(p), rows});
    data.push_back({"start" + std::to_string(p), {rows.front()}});
    data.push_back(
        {"step" + std::to_string(p), {{time_in_step(rows), 0.0}, {time_in_step(rows), 18.0}}});
  }
  if (dir) {
    report.plots.push_back(*dir / "fig-4.3.png");
    const auto both = [](const char* s) { return std::string(s); };
    plot::plot_png(
        report.plots.back(), 1100, 480, data,
        "set multiplot layout 1,2 title 'Two pairs of coupled phases, φ̇ = ω + k Δφ'\nset grid\n"
        "set key top left\nset xlabel 'time [s]'\nset ylabel 'phase [rad]'\nset xrange [0:8]\n"
        "set yrange [0:18]\nset title 'a) phases; dashed: from there on in step'\n" +
            both(
                "plot $pair0 using 1:2 with lines ls 1 title 'pair 1', $pair0 using 1:3 with lines "
                "ls 1 notitle, $pair1 using 1:2 with lines ls 3 title 'pair 2', $pair1 using 1:3 "
                "with lines ls 3 notitle, $step0 with lines ls 1 dt 2 lw 1 notitle, $step1 with "
                "lines ls 3 dt 2 lw 1 notitle\n") +
            "set title 'b) both wind onto the invariant line φ₁ = φ₂'\nset size ratio -1\n"
            "set xlabel 'φ₁ [rad]'\nset ylabel 'φ₂ [rad]'\nset xrange [0:12]\nset yrange [0:12]\n"
            "plot x with lines lw 1 dt 2 lc rgb '#404040' title 'φ₁ = φ₂', $pair0 using 2:3 with "
            "lines ls 1 title 'pair 1', $pair1 using 2:3 with lines ls 3 title 'pair 2', $start0 "
            "using 2:3 with points ls 1 pt 7 notitle, $start1 using 2:3 with points ls 3 pt 7 "
            "notitle\nunset multiplot");
  }
  return report;
}

/// Ways to sum differences; ours is rule III as the engine has it.
enum class Way { ours, wrapped, sines };
constexpr const char* kWays[] = {"ours", "sum of wrapped differences", "sum of sines"};

/// Phases one second later, in the ways that are not the engine's, which differ from it in nothing
/// else.
std::vector<double> second_later(Way way, const CouplingGraph& graph, double k, double dt,
                                 const std::vector<double>& from) {
  const auto pull = [&](double off) {
    return k * (way == Way::sines ? std::sin(off) : math::wrap_pi(off));
  };
  const auto f = [&](double, const Phases& x) {
    Phases rate = Phases::Zero(x.size());
    for (int i = 0; i < graph.size(); ++i) {
      for (int j = 0; graph.complete() && j < graph.size(); ++j) rate[i] += pull(x[j] - x[i]);
      for (const auto& other : graph.neighbours(i)) {
        rate[i] += other.weight * pull(x[other.index] - x[i]);
      }
    }
    return rate;
  };
  Phases phi = Eigen::Map<const Eigen::VectorXd>(from.data(), Eigen::Index(from.size()));
  for (double t = 0.0; t < 1.0; t += dt) phi = math::rk4_step(f, 0.0, phi, dt);
  return {phi.begin(), phi.end()};
}

/// Fraction of random starts that come to synchrony.
double synchronised(Way way, Topology topology, int n) {
  const auto graph = CouplingGraph::make(topology, n);
  const Extremes e = extremes(topology, n);
  const double k = 1.0 / e.least;
  std::mt19937_64 draw(static_cast<std::uint64_t>(100 * n + int(topology)));
  Rules rules;
  rules.phase = {{topology}, k};
  // Sines hardly pull where phases are opposite.
  const int until_s = way == Way::sines && graph.complete() ? 60 : 12;
  int count = 0;
  for (int start = 0; start < kStarts; ++start) {
    std::vector<double> phi = uniform(n, 0.0, kTwoPi, draw);
    Crowd crowd = one_group(rules, phi, std::min(0.05, 0.5 / (k * e.most)));
    for (int second = 1; second <= until_s; ++second) {
      if (way == Way::ours) {
        while (crowd.time_s() < second) crowd.step();
        phi.assign(crowd.phase_rad().begin(), crowd.phase_rad().end());
      } else {
        phi = second_later(way, graph, k, std::min(0.05, 1.2 / (k * e.most)), phi);
      }
      if (spread(phi) > 0.02) continue;
      ++count;
      break;
    }
  }
  return double(count) / kStarts;
}

/// Fraction of random starts of six followers that come to their leader.
double led(Topology topology) {
  std::mt19937_64 draw(31);
  Rules rules;
  rules.phase = {{topology}, 0.4, 0.5};
  int count = 0;
  for (int start = 0; start < kStarts; ++start) {
    Crowd crowd = one_group(rules, uniform(7, 0.0, kTwoPi, draw), 0.05);
    while (crowd.time_s() < 40.0 && spread(crowd.phase_rad()) > 0.01) crowd.step();
    const double leader = crowd.phase_rad()[0];
    count += std::ranges::all_of(
        crowd.phase_rad(), [&](double p) { return std::abs(math::wrap_pi(p - leader)) < 0.03; });
  }
  return double(count) / kStarts;
}

/// Shares that another program saw in 500 other draws, in groups of 5, 8 and 16; all came into step
/// along chains and stars, and by sines all-to-all.
double seen_elsewhere(Way way, Topology topology, int n) {
  const std::size_t i = n == 5 ? 0 : n == 8 ? 1 : 2;
  if (topology == Topology::wheel) return std::nan("");
  if (topology == Topology::ring) {
    return (way == Way::sines ? std::array{0.94, 0.77, 0.57} : std::array{0.62, 0.49, 0.32})[i];
  }
  const bool all = topology == Topology::all_to_all;
  return all && way == Way::wrapped ? std::array{0.64, 0.33, 0.21}[i] : 1.0;
}

Report random_start(const PlotDir&) {
  constexpr Topology kStartGraphs[] = {Topology::chain, Topology::star, Topology::ring,
                                       Topology::wheel, Topology::all_to_all};
  Report report;
  for (int w = 0; w < 3; ++w) {
    for (const Topology topology : kStartGraphs) {
      for (const int n : {5, 8, 16}) {
        const double share = synchronised(Way(w), topology, n);
        const std::string what = std::string(kWays[w]) + ", " + std::string(to_string(topology)) +
                                 " of " + std::to_string(n) + ": share of 500 starts";
        if (w == 0) report.near(what, share, goal(1.0), 0.0, "1");
        const double p = seen_elsewhere(Way(w), topology, n);
        if (w > 0 && !std::isnan(p)) {
          report.near(what, share, prototype(p, "crowd.md"),
                      3.0 * std::sqrt(2.0 * std::max(p * (1.0 - p), 0.002) / kStarts), "1",
                      "three standard deviations of the difference");
        }
      }
    }
  }
  for (const Topology topology :
       {Topology::chain, Topology::star, Topology::ring, Topology::all_to_all}) {
    const HopfOutcome o = run({.topology = topology,
                               .n = 8,
                               .k_1_s = 1.2 / printed_lambda(topology, 8),
                               .trials = kStarts,
                               .dt_s = 0.05});
    report.near("Andronov-Hopf networks, kλ⁺ = 1.2, " + std::string(to_string(topology)) +
                    " of 8: share of 500 starts",
                o.synchronised / double(kStarts), closed_form(1.0, "contracts for kλ⁺ > 1"), 0.0,
                "1");
  }
  for (const Topology topology : {Topology::chain, Topology::ring, Topology::all_to_all}) {
    report.near("leader of six, " + std::string(to_string(topology)) +
                    ": share of 500 starts that reach it",
                led(topology), goal(1.0), 0.0, "1");
  }
  return report;
}

}  // namespace

void add_start_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("fig-4.3", "two pairs of phases come into step, when depends on the start", "M18",
                  Declared{.closed_form = 4}, pairs);
  to.emplace_back("random-starts", "500 random starts on every coupling graph", "M18",
                  Declared{.closed_form = 4, .prototype = 24, .goal = 18}, random_start);
}

}  // namespace mimesis::crowd
