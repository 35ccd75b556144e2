#include "experiments/crowd/hopf_trials.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "common/error.h"
#include "common/math/integrator.h"
#include "experiments/crowd/oscillators.h"
#include "nodes/crowd/certificate/rate_fit.h"

namespace mimesis::crowd {
namespace {

constexpr int kMost = 16;
using States = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMost>;

States random_start(int n, std::mt19937_64& draw) {
  std::uniform_real_distribution<double> uniform(0.0, 2.0 * std::numbers::pi);
  States x(2, n);
  for (int i = 0; i < n; ++i) {
    const double phi = uniform(draw);
    x.col(i) << std::cos(phi), std::sin(phi);
  }
  return x;
}

/// R̂ of the phases [M18 4.3.6]. 1 − |mean| as mean (1 − cos), which keeps its digits.
double dispersion_of(const States& x) {
  Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMost> unit = x;
  unit.colwise().normalize();
  const Eigen::Vector2d mean = unit.rowwise().sum().normalized();
  return std::sqrt(0.5 * (unit.colwise() - mean).squaredNorm() / double(x.cols()));
}

}  // namespace

double printed_lambda(Topology topology, int n) {
  switch (topology) {
    case Topology::star:
      return 1.0;
    case Topology::all_to_all:
      return n;
    case Topology::chain:
      return 2.0 * (1.0 - std::cos(std::numbers::pi / n));
    case Topology::ring:
      return 2.0 * (1.0 - std::cos(2.0 * std::numbers::pi / n));
    default:
      throw ConfigError("table 4.1 has no such graph");
  }
}

HopfOutcome run(const HopfTrials& t) {
  if (t.n > kMost) throw ConfigError("Hopf trials: at most 16 oscillators");
  const auto graph = CouplingGraph::make(t.topology, t.n);
  const dmp::AndronovHopf oscillator{t.omega_rad_s};
  const auto f = [&](double, const States& x) {
    States rate(2, x.cols());
    hopf_network_rate(graph, oscillator, t.k_1_s, {}, x, rate);
    return rate;
  };
  const double stiff =
      4.0 * std::abs(t.k_1_s) * std::max(1.0, 0.25 * t.n);  // above kλ_max of all graphs here
  const int per_sample =
      static_cast<int>(std::ceil(t.sample_s / std::min(t.dt_s, 1.0 / stiff) - 1e-9));
  const double dt = t.sample_s / per_sample;
  const auto samples = static_cast<std::size_t>(std::lround(t.until_s / t.sample_s));

  HopfOutcome out;
  if (t.curve) {
    out.mean_log_r.assign(samples, 0.0);
    out.mean_r.assign(samples, 0.0);
    for (std::size_t s = 0; s < samples; ++s) out.time_s.push_back(double(s) * t.sample_s);
  }
  std::mt19937_64 draw(static_cast<std::uint64_t>(1000 * t.n + int(t.topology)));
  for (int trial = 0; trial < t.trials; ++trial) {
    States x = random_start(t.n, draw);
    RateFit fit(kLeastR, kMostR);
    bool in_step = false;
    for (std::size_t s = 0; s < samples; ++s) {
      const double r = dispersion_of(x);
      in_step = in_step || r < 1e-3;
      fit.add(double(s) * t.sample_s, r);
      if (t.curve) {
        out.mean_log_r[s] += std::log(std::max(r, 1e-12)) / t.trials;
        out.mean_r[s] += r / t.trials;
      } else if (r < kLeastR) {
        break;
      }
      for (int k = 0; k < per_sample; ++k) x = math::rk4_step(f, 0.0, x, dt);
    }
    out.synchronised += in_step;
    if (const auto rate = fit.rate_1_s(); rate && in_step) out.rate_1_s.push_back(*rate);
  }
  return out;
}

}  // namespace mimesis::crowd
