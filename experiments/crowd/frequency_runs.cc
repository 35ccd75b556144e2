#include "experiments/crowd/frequency_runs.h"

#include <array>

#include "common/math/integrator.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

std::span<const double> column(const FrequencyRun::State& x, Eigen::Index i) {
  return {x.col(i).data(), std::size_t(x.rows())};
}

}  // namespace

FrequencyRun::State FrequencyRun::tied(const std::vector<double>& phi_rad) const {
  State x(graph.size(), 3);
  x.col(2).setZero();
  for (int i = 0; i < graph.size(); ++i) {
    x(i, 0) = phi_rad[std::size_t(i)];
    x(i, 1) = gait.integral(x(i, 0)) + place_m[std::size_t(i)];
  }
  return x;
}

void FrequencyRun::step(State& x, double dt_s) const {
  const bool filtered = rule.low_pass_rad_s > 0.0;
  const auto f = [&](double, const State& s) {
    State rate(s.rows(), 3);
    Eigen::ArrayXd error(s.rows());
    spacing_errors(graph, column(s, 1), place_m, {error.data(), std::size_t(s.rows())});
    for (Eigen::Index i = 0; i < s.rows(); ++i) {
      const double kept = saturate(filtered ? s(i, 2) : error[i], rule.saturation_m);
      const double phi_rate = omega_rad_s + frequency_change(rule.gain_rad_m_s, kept);
      rate(i, 0) = phi_rate;
      rate(i, 1) = phi_rate * gait(s(i, 0));
      rate(i, 2) = filtered ? rule.low_pass_rad_s * (error[i] - s(i, 2)) : 0.0;
    }
    return rate;
  };
  x = math::rk4_step(f, 0.0, x, dt_s);
}

double FrequencyRun::error_m(const State& x) const {
  const Eigen::ArrayXd off =
      x.col(1) - Eigen::Map<const Eigen::ArrayXd>(place_m.data(), Eigen::Index(place_m.size()));
  return off.maxCoeff() - off.minCoeff();
}

SpeedFunction gait_of(double mean_m_rad, double amplitude) {
  const std::array cosine{0.0, amplitude * mean_m_rad};
  return {mean_m_rad, cosine, {}};
}

}  // namespace mimesis::crowd
