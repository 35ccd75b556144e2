#include "nodes/cognition/transient_field.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/error.h"
#include "nodes/cognition/exponential.h"

namespace mimesis::cognition {
namespace {

double sigmoid(double u, double slope, double threshold) {
  return 1.0 / (1.0 + exponential(-slope * (u - threshold)));
}

std::vector<double> half_kernel(double amplitude, double width, double dx) {
  std::vector<double> w;
  for (int i = 0; i * dx <= 4.0 * width; ++i) {
    const double d = i * dx;
    w.push_back(amplitude * std::exp(-0.5 * d * d / (width * width)) * dx);
  }
  return w;
}

double weighted(const std::vector<double>& w, std::span<const double> rate, std::size_t i) {
  double sum = w[0] * rate[i];
  for (std::size_t d = 1; d < w.size(); ++d) {
    if (d <= i) sum += w[d] * rate[i - d];
    if (i + d < rate.size()) sum += w[d] * rate[i + d];
  }
  return sum;
}

void demand(bool ok, const char* what) {
  if (!ok) throw ConfigError(std::string("transient field: ") + what);
}

}  // namespace

TransientField::TransientField(const TransientParams& p, double dt_s) : params_(p), dt_s_(dt_s) {
  demand(p.neurons >= 2 && p.dx > 0.0, "neurons must be at least 2, dx positive");
  demand(dt_s > 0.0 && dt_s <= p.tau_u_s && p.tau_u_s < p.tau_v_s,
         "expected step <= tau_u_s < tau_v_s: inhibition follows excitation");
  demand(p.resting_level < 0.0, "resting_level must be negative");
  demand(p.width_u > 0.0 && p.width_u < p.width_v, "expected width_u < width_v [M18 2.5]");
  kernel_u_ = half_kernel(p.excitation, p.width_u, p.dx);
  kernel_v_ = half_kernel(p.inhibition, p.width_v, p.dx);
  for (auto* all : {&u_, &v_, &input_, &rate_}) all->resize(static_cast<std::size_t>(p.neurons));
  reset();
}

void TransientField::reset() {
  std::ranges::fill(u_, params_.resting_level);
  std::ranges::fill(v_, 0.0);
  std::ranges::fill(input_, 0.0);
  std::ranges::fill(rate_, sigmoid(params_.resting_level, params_.slope, 0.0));
}

void TransientField::step() {
  const TransientParams& p = params_;
  for (std::size_t i = 0; i < u_.size(); ++i) {
    const double gate = rate_[i];  // g = f for u
    const double drive_v = weighted(kernel_v_, rate_, i);
    const double du =
        -u_[i] + p.resting_level + input_[i] + gate * (weighted(kernel_u_, rate_, i) - v_[i]);
    u_[i] += dt_s_ / p.tau_u_s * du;
    v_[i] += dt_s_ / p.tau_v_s * (-v_[i] + sigmoid(v_[i], p.slope_v, p.threshold_v) * drive_v);
    input_[i] = 0.0;
  }
  for (std::size_t i = 0; i < u_.size(); ++i) rate_[i] = sigmoid(u_[i], p.slope, 0.0);
}

ShuntedLink::ShuntedLink(const ShuntedParams& params, double dt_s, std::size_t targets,
                         std::size_t sources, double weight)
    : params_(params),
      dt_s_(dt_s),
      targets_(targets),
      weights_(targets * sources, weight),
      shunt_(targets) {
  demand(params.beta >= 0.0 && params.beta < params.alpha, "expected 0 <= beta < alpha");
  demand(dt_s > 0.0 && dt_s <= params.tau_s, "the step must be positive and at most tau_s");
}

void ShuntedLink::transmit(std::span<const double> source_rate, double gain,
                           std::span<double> input) const {
  for (std::size_t j = 0; j < source_rate.size(); ++j) {
    const double rate = gain * source_rate[j];
    for (std::size_t i = 0; i < targets_; ++i) input[i] += weights_[j * targets_ + i] * rate;
  }
}

void ShuntedLink::learn(std::span<const double> target_activity,
                        std::span<const double> target_rate, std::span<const double> source_rate) {
  const double share = dt_s_ / params_.tau_s;
  for (std::size_t i = 0; i < targets_; ++i) {
    shunt_[i] = sigmoid(target_activity[i], params_.slope, params_.threshold);
  }
  for (std::size_t j = 0; j < source_rate.size(); ++j) {
    double* const column = weights_.data() + j * targets_;
    for (std::size_t i = 0; i < targets_; ++i) {
      const double hebb = params_.alpha * source_rate[j] * target_rate[i] - column[i];
      column[i] += share * (shunt_[i] * hebb - params_.beta * column[i]);
    }
  }
}

}  // namespace mimesis::cognition
