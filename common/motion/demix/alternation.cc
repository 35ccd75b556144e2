#include "common/motion/demix/alternation.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <complex>

#include "common/motion/demix/anderson.h"
#include "common/motion/demix/shift_kernels.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

}  // namespace

Alternation::Alternation(MatrixXd data, const Layout& layout)
    : layout_(layout), data_(std::move(data)), energies_(layout.groups) {
  const Index p = layout_.group_size;
  for (Index g = 0; g < layout_.groups; ++g) {
    energies_[g] = data_.middleCols(g * p, p).squaredNorm();
  }
  energy_ = energies_.sum();
}

template <class Step>
void Alternation::each_group(const Step& step) {
  const Index p = layout_.group_size;
  fit_[0].set_sources(sources_);
  error_ = 0.0;
  for (Index g = 0; g < layout_.groups; ++g) {
    error_ += step(fit_[0], data_.col(g * p).data(), energies_[g], phi_.col(g).data(),
                   weights_.col(g * p).data());
  }
}

void Alternation::start(const MatrixXd& sources, const MatrixXd& phi) {
  const Index count = sources.cols();
  sources_ = sources;
  phi_ = phi;
  weights_ = MatrixXd::Zero(count, data_.cols());
  fit_.clear();
  fit_.emplace_back(data_.rows() / 2, count, layout_.group_size, layout_.frozen,
                    layout_.nonnegative, layout_.seed);
  pair_.resize(data_.rows(), count * count);
  right_.resize(data_.rows(), count);
  each_group([](GroupFit& fit, const double* x, double energy, double* delay, double* w) {
    return fit.weights(x, energy, delay, w);
  });
}

void Alternation::search(int restarts) {
  each_group([restarts](GroupFit& fit, const double* x, double energy, double* phi, double* w) {
    return fit.search(x, energy, phi, w, restarts);
  });
}

void Alternation::refine(int steps) {
  each_group([steps](GroupFit& fit, const double* x, double energy, double* phi, double* w) {
    return fit.refine(x, energy, phi, w, steps);
  });
}

MatrixXd Alternation::residual() const {
  const Index half = data_.rows() / 2, p = layout_.group_size;
  MatrixXd out = data_, z(2 * half, sources_.cols());
  for (Index g = 0; g < layout_.groups; ++g) {
    for (Index k = 0; k < sources_.cols(); ++k) {
      shift_spectrum(sources_.col(k).data(), phi_(k, g), half, z.col(k).data(), nullptr);
    }
    out.middleCols(g * p, p) -= z * weights_.middleCols(g * p, p);
  }
  return out;
}

double Alternation::quality() const {
  return 1.0 - std::sqrt((std::max(0.0, error_) + left_out_) / (energy_ + left_out_));
}

void Alternation::normal_matrices() {
  // Aₖₗ(f) = Σ wₖwₗ e^{if(φₖ−φₗ)}, bₖ(f) = Σ wₖ e^{ifφₖ} x(f)
  const Index half = data_.rows() / 2, count = sources_.cols(), p = layout_.group_size;
  VectorXd one(2 * half), mixed(2 * half), turned(2 * half);
  one << VectorXd::Ones(half), VectorXd::Zero(half);
  MatrixXd moment(count, count), sums(2 * half, count);
  pair_.setZero();
  right_.setZero();
  for (Index g = 0; g < layout_.groups; ++g) {
    const auto w = weights_.middleCols(g * p, p);
    moment.noalias() = w * w.transpose();
    sums.noalias() = data_.middleCols(g * p, p) * w.transpose();
    for (Index k = 0; k < count; ++k) {
      shift_spectrum(sums.col(k).data(), -phi_(k, g), half, turned.data(), nullptr);
      right_.col(k) += turned;
      for (Index l = 0; l < k; ++l) {
        shift_spectrum(one.data(), phi_(l, g) - phi_(k, g), half, turned.data(), nullptr);
        pair_.col(k + l * count) += moment(k, l) * turned;
      }
      pair_.col(k + k * count).head(half).array() += moment(k, k);
    }
  }
}

void Alternation::update_sources() {
  if (layout_.frozen == sources_.cols()) return;
  normal_matrices();
  const Index half = data_.rows() / 2, count = sources_.cols();
  const Index frozen = layout_.frozen, free = count - frozen;
  Eigen::MatrixXcd a(count, count);
  Eigen::VectorXcd b(count), kept(frozen);
  for (Index f = 0; f < half; ++f) {
    for (Index k = 0; k < count; ++k) {
      b[k] = {right_(f, k), right_(half + f, k)};
      for (Index l = 0; l <= k; ++l) {
        a(k, l) = {pair_(f, k + l * count), pair_(half + f, k + l * count)};
        a(l, k) = std::conj(a(k, l));
      }
    }
    for (Index k = 0; k < frozen; ++k) kept[k] = {sources_(f, k), sources_(half + f, k)};
    b.tail(free) -= a.bottomLeftCorner(free, frozen) * kept;
    Eigen::MatrixXcd rest = a.bottomRightCorner(free, free);
    rest.diagonal().array() += 1e-10 * rest.diagonal().real().maxCoeff() + 1e-300;
    const Eigen::VectorXcd s = rest.llt().solve(b.tail(free));
    for (Index k = 0; k < free; ++k) {
      sources_(f, frozen + k) = s[k].real();
      sources_(half + f, frozen + k) = s[k].imag();
    }
  }
  scale_sources();
}

void Alternation::scale_sources() {
  for (Index k = layout_.frozen; k < sources_.cols(); ++k) {
    const double norm = sources_.col(k).norm();
    if (norm <= 0.0) continue;
    sources_.col(k) /= norm;
    weights_.row(k) *= norm;
  }
}

void Alternation::run(const Limits& limits, std::vector<double>* trace) {
  Anderson acceleration(5);
  MatrixXd plain = sources_, kept_phi = phi_, kept_weights = weights_;
  bool extrapolated = false;
  double before = error_;
  const Index frozen = layout_.frozen, free = sources_.cols() - frozen;
  const auto undo = [&] {
    sources_ = plain;
    phi_ = kept_phi;
    weights_ = kept_weights;
    refine(2);
  };
  for (int turn = 0; turn < limits.turns && free > 0; ++turn) {
    search(limits.restarts);
    if (extrapolated && error_ > before) {
      undo();
      acceleration.clear();
      extrapolated = false;
    }
    if (trace != nullptr) trace->push_back(quality());
    const double total = energy_ + left_out_;
    const bool settled =
        std::sqrt(std::max(0.0, before) / total) - std::sqrt(std::max(0.0, error_) / total) <
        limits.tolerance;
    before = error_;
    if (settled && turn > 2) {
      extrapolated = false;
      break;
    }
    const MatrixXd from = sources_.rightCols(free);
    update_sources();
    plain = sources_;
    kept_phi = phi_;
    kept_weights = weights_;
    const MatrixXd next = acceleration.next(from, sources_.rightCols(free));
    extrapolated = acceleration.size() > 1;
    sources_.rightCols(free) = next;
    scale_sources();
  }
  refine(1);
  if (extrapolated && error_ > before) undo();
}

}  // namespace mimesis::demix
