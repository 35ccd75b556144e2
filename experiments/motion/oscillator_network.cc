#include "experiments/motion/oscillator_network.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

void check(std::size_t n, const Eigen::MatrixXd& k, double dt_s, Integrator integrator) {
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
  const double limit = integrator == Integrator::rk4 ? 2.7 : 0.16;
  const double worst = k.rowwise().sum().maxCoeff() * dt_s;
  need(worst < limit,
       "coupling times dt is " + std::to_string(worst) + ", stable below " + std::to_string(limit));
}

}  // namespace

template <class Kind>
OscillatorNetwork<Kind>::OscillatorNetwork(std::vector<Kind> oscillators,
                                           Eigen::MatrixXd coupling_1_s, double dt_s,
                                           Integrator integrator)
    : kinds_(std::move(oscillators)),
      coupling_(std::move(coupling_1_s)),
      dt_(dt_s),
      integrator_(integrator),
      adams_(dt_s) {
  check(kinds_.size(), coupling_, dt_, integrator_);
  x_.setZero(2, size());
  external_ = x_;
  alpha_.setZero(size());
  for (int i = 0; i < size(); ++i) set_phase(i, 0.0);
}

template <class Kind>
void OscillatorNetwork<Kind>::set_state(int i, const Eigen::Vector2d& x) {
  MIMESIS_ASSERT(x.allFinite());
  x_.col(i) = x;
  adams_.restart();
}

template <class Kind>
void OscillatorNetwork<Kind>::set_phase(int i, double phase_rad) {
  set_state(i, kinds_[static_cast<std::size_t>(i)].from_circle(
                   {std::cos(phase_rad), std::sin(phase_rad)}));
}

template <class Kind>
void OscillatorNetwork<Kind>::set_frequency(int i, double omega_rad_s) {
  MIMESIS_ASSERT(std::isfinite(omega_rad_s));
  Kind& kind = kinds_[static_cast<std::size_t>(i)];
  const Eigen::Vector2d u = circle(i);  // the place on the circle stays
  kind.omega_rad_s = omega_rad_s;
  set_state(i, kind.from_circle(u));
}

template <class Kind>
void OscillatorNetwork<Kind>::set_external(int i, const Eigen::Vector2d& y, double alpha_1_s) {
  MIMESIS_ASSERT(y.allFinite() && alpha_1_s >= 0.0 && std::isfinite(alpha_1_s));
  if (alpha_[i] != alpha_1_s) adams_.restart();
  external_.col(i) = y;
  alpha_[i] = alpha_1_s;
}

template <class Kind>
typename OscillatorNetwork<Kind>::States OscillatorNetwork<Kind>::rate(const States& x) const {
  States d(2, x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const Eigen::Vector2d own = x.col(i);
    Eigen::Vector2d sum = kinds_[static_cast<std::size_t>(i)].rate(own);
    for (Eigen::Index j = 0; j < x.cols(); ++j) {
      if (coupling_(i, j) != 0.0) sum += coupling_(i, j) * Kind::pull(own, x.col(j));
    }
    d.col(i) = sum + alpha_[i] * Kind::pull(own, external_.col(i));
  }
  return d;
}

template <class Kind>
void OscillatorNetwork<Kind>::step() {
  auto f = [this](double, const States& x) { return rate(x); };
  if (integrator_ == Integrator::rk4) {
    x_ = math::rk4_step(f, 0.0, x_, dt_);
  } else {
    adams_.step(f, 0.0, x_);
  }
}

template class OscillatorNetwork<VanDerPol>;
template class OscillatorNetwork<AndronovHopf>;

Eigen::MatrixXd all_to_all(int n, double k_1_s) {
  Eigen::MatrixXd k = Eigen::MatrixXd::Constant(n, n, k_1_s);
  k.diagonal().setZero();
  return k;
}

Eigen::MatrixXd star(int n, double k_1_s) {
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(n, n);
  k.col(0).tail(n - 1).setConstant(k_1_s);
  return k;
}

}  // namespace mimesis::synthesizer
