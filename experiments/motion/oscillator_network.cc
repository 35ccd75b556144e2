#include "experiments/motion/oscillator_network.h"

#include <algorithm>

#include "common/error.h"
#include "common/math/integrator.h"

namespace mimesis::synthesizer {
namespace {

void check(std::size_t n, const Eigen::MatrixXd& k, double dt_s) {
  auto need = [](bool condition, const std::string& what) {
    if (!condition) throw ConfigError("oscillator network: " + what);
  };
  const auto size = static_cast<Eigen::Index>(n);
  need(n >= 1 && n <= 32, std::to_string(n) + " oscillators, expected 1 to 32");
  need(k.rows() == size && k.cols() == size,
       "the coupling matrix must be " + std::to_string(n) + "x" + std::to_string(n));
  need(k.allFinite() && k.minCoeff() >= 0.0 && k.diagonal().isZero(0.0),
       "couplings must be finite, not negative, with a zero diagonal");
  need(dt_s > 0.0, "dt must be positive");
  const double worst = k.rowwise().sum().maxCoeff() * dt_s;
  need(worst < 2.7, "coupling times dt is " + std::to_string(worst) + ", stable below 2.7");
}

}  // namespace

OscillatorNetwork::OscillatorNetwork(std::vector<VanDerPol> oscillators,
                                     Eigen::MatrixXd coupling_1_s, double dt_s)
    : kinds_(std::move(oscillators)), coupling_(std::move(coupling_1_s)), dt_(dt_s) {
  check(kinds_.size(), coupling_, dt_);
  x_.setZero(2, size());
  external_ = x_;
  alpha_.setZero(size());
  for (int i = 0; i < size(); ++i) set_phase(i, 0.0);
}

void OscillatorNetwork::set_state(int i, const Eigen::Vector2d& x) {
  MIMESIS_ASSERT(x.allFinite());
  x_.col(i) = x;
}

void OscillatorNetwork::set_phase(int i, double phase_rad) {
  set_state(i, kinds_[static_cast<std::size_t>(i)].from_circle(
                   {std::cos(phase_rad), std::sin(phase_rad)}));
}

void OscillatorNetwork::set_external(int i, const Eigen::Vector2d& y, double alpha_1_s) {
  MIMESIS_ASSERT(y.allFinite() && alpha_1_s >= 0.0 && std::isfinite(alpha_1_s));
  external_.col(i) = y;
  alpha_[i] = alpha_1_s;
}

OscillatorNetwork::States OscillatorNetwork::rate(const States& x) const {
  States d(2, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Eigen::Vector2d own = x.col(i);
    Eigen::Vector2d sum = kinds_[static_cast<std::size_t>(i)].rate(own);
    for (Eigen::Index j = 0; j < x.cols(); ++j) {
      if (coupling_(i, j) != 0.0) sum += coupling_(i, j) * VanDerPol::pull(own, x.col(j));
    }
    d.col(i) = sum + alpha_[i] * VanDerPol::pull(own, external_.col(i));
  }
  return d;
}

void OscillatorNetwork::step() {
  x_ = math::rk4_step([this](double, const States& x) { return rate(x); }, 0.0, x_, dt_);
}

Eigen::MatrixXd all_to_all(int n, double k_1_s) {
  Eigen::MatrixXd k = Eigen::MatrixXd::Constant(n, n, k_1_s);
  k.diagonal().setZero();
  return k;
}

}  // namespace mimesis::synthesizer
