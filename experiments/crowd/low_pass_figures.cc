// Rule I behind a low-pass. [M10] filters without normalising, ż = −α z + G and φ̇ = −m L z, and has
// the bound α > √(m g_max λ_max). Rule I's filter has gain one: its m_d is m / α, its bound
// α > m_d g_max λ_max.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <utility>
#include <vector>

#include "common/math/circle.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/figures.h"
#include "nodes/crowd/certificate/contraction.h"

namespace mimesis::crowd {
namespace {

using namespace reproduce;

constexpr double kFilterStep_s = 0.001;
constexpr double kFactors[] = {0.05, 0.1, 0.25, 1.0, 2.0};

struct Case {
  Topology topology;
  int n;
  double amplitude;  ///< amplitude of g

  double most_lambda() const { return extremes(topology, n).most; }
  /// m ⟨g⟩ [1/s²] with which the fastest mode swings at √(m⟨g⟩λ_max) = ω, half as fast as g: behind
  /// a slow low-pass the gait pumps it.
  double gain() const { return kOmega_rad_s * kOmega_rad_s / most_lambda(); }
  double bound() const { return std::sqrt(gain() * (1.0 + amplitude) * most_lambda()); }
};

/// Agents one cycle apart, with phases in [0, width).
Crowd filtered(const Case& c, double alpha, double width) {
  std::mt19937_64 draw(17);
  std::vector<double> place;
  for (int i = 0; i < c.n; ++i) place.push_back(-i * math::kTwoPi * kMean_m_rad);
  return tied_crowd({.graph = {c.topology},
                     .gain_rad_m_s = c.gain() / kMean_m_rad / alpha,
                     .low_pass_rad_s = alpha},
                    gait_of(c.amplitude), place, uniform(c.n, 0.0, width, draw), kFilterStep_s);
}

/// Largest phase error of a cycle, as it swings through zero.
double most_of_cycle(Crowd& crowd) {
  double most = 0.0;
  for (const double end = crowd.time_s() + math::kTwoPi / kOmega_rad_s; crowd.time_s() < end;
       crowd.step()) {
    most = std::max(most, spread(crowd.phase_rad()));
  }
  return most;
}

/// Rate of the engine's small errors, over cycles of the gait; < 0 where they grow: of their later
/// part, when the slowest is left.
double measured(const Case& c, double alpha, bool grows) {
  Crowd crowd = filtered(c, alpha, grows ? 1e-8 : 0.1);
  std::vector<std::pair<double, double>> log;
  for (double e = most_of_cycle(crowd); log.size() < 500 && e > 1e-9 && e < 0.2;
       e = most_of_cycle(crowd)) {
    log.emplace_back(crowd.time_s(), std::log(e));
  }
  if (log.size() < 4) return std::nan("");
  const auto& [from, begin] = log[log.size() / 3];
  const auto& [to, end] = log.back();
  return (begin - end) / (to - from);
}

/// Rate of the slowest of all modes (or the one that grows fastest) of δφ̇ = −m ε,
/// ε̇ = α (λ g(ωt) δφ − ε), over a cycle.
double expected(const Case& c, double alpha) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(
      CouplingGraph::make(c.topology, c.n).laplacian());
  const double m = c.gain() / kMean_m_rad / alpha;
  const SpeedFunction g = gait_of(c.amplitude);
  double least = 1e9;
  for (const double lambda : modes.eigenvalues().tail(c.n - 1)) {
    least = std::min(
        least, periodic_rate([&](double phi) -> Eigen::Matrix2d {
          return Eigen::Matrix2d{{0.0, -m}, {alpha * lambda * g(phi), -alpha}} / kOmega_rad_s;
        }));
  }
  return kOmega_rad_s * least;
}

Report low_pass(const PlotDir&) {
  Report report;
  for (const Case& c : {Case{Topology::all_to_all, 5, 0.8},
                        {Topology::all_to_all, 8, 0.3},
                        {Topology::ring, 8, 0.8},
                        {Topology::ring, 10, 0.3}}) {
    for (const double factor : kFactors) {
      const double alpha = factor * c.bound(), rate = expected(c, alpha);
      std::ostringstream what;
      what << to_string(c.topology) << " of " << c.n << ", g ± " << 100.0 * c.amplitude
           << " %: rate at α = " << factor << " × bound";
      // At the bound few swings are above rounding; along rings several modes grow alike.
      const bool rough = factor == 1.0 || (c.topology == Topology::ring && rate < 0.0);
      const double seen = rough ? 0.15 : 0.02;
      report.near(what.str(), measured(c, alpha, rate < 0.0),
                  closed_form(rate, "Floquet rate of the equation"),
                  seen * std::abs(rate) + kOmega_rad_s * kOmega_rad_s * kFilterStep_s / 3.0, "1/s",
                  "the engine's filter is half a step behind");
      if (factor < 1.0) continue;
      Crowd crowd = filtered(c, alpha, math::kTwoPi);
      double error = 1.0;
      while (crowd.time_s() < 80.0 && error > 1e-2) error = most_of_cycle(crowd);
      report.at_most(what.str() + ", from anywhere: phase error in 80 s", error, 1e-2, "rad",
                     "contracts above the bound");
    }
  }
  return report;
}

}  // namespace

void add_low_pass_figures(std::vector<reproduce::Figure>& to) {
  to.emplace_back("low-pass", "spacing control behind a low-pass, above and below its bound", "M10",
                  Declared{.closed_form = 20, .goal = 8}, low_pass);
}

}  // namespace mimesis::crowd
