#include "nodes/synthesizer/demix/group_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "nodes/synthesizer/demix/shift_kernels.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRidge = 1e-9;   // of a source's energy: two sources may coincide
constexpr double kMaxStep = 0.5;  // of a Levenberg step [rad]

MatrixXd grid_table(Index half) {
  const Index count = half <= 16 ? 64 : 128;
  MatrixXd table(count, 2 * half);
  for (Index j = 0; j < count; ++j) {
    for (Index f = 0; f < half; ++f) {
      const double angle =
          math::kTwoPi * static_cast<double>((f + 1) * j % count) / static_cast<double>(count);
      table(j, f) = std::cos(angle);
      table(j, half + f) = -std::sin(angle);
    }
  }
  return table;
}

/// min ½wᵀGw − yᵀw, w ≥ 0, by coordinate descent from the unconstrained solution, clipped.
void clip_and_descend(const MatrixXd& gram, const double* y, Eigen::Ref<VectorXd> w) {
  w = w.cwiseMax(0.0);
  for (int turn = 0; turn < 200; ++turn) {
    double moved = 0.0;
    for (Index k = 0; k < w.size(); ++k) {
      const double before = w[k];
      const double slope = gram.col(k).dot(w) - y[k];
      w[k] = std::max(0.0, before - slope / gram(k, k));
      moved = std::max(moved, std::abs(w[k] - before));
    }
    if (moved <= 1e-10 * w.maxCoeff()) break;
  }
}

}  // namespace

GroupFit::GroupFit(Index half, Index sources, Index group, Index frozen, bool nonnegative)
    : half_(half),
      k_(sources),
      p_(group),
      frozen_(frozen),
      nonnegative_(nonnegative),
      sources_(2 * half, sources),
      z_(2 * half, sources),
      dz_(2 * half, sources),
      gram_(sources, sources),
      factor_(sources, sources),
      y_(sources, group),
      cross_(sources, sources),
      dgram_(sources, sources),
      dy_(sources, group),
      moment_(sources, sources),
      curvature_(sources, sources),
      damped_(sources, sources),
      trial_w_(sources, group),
      basis_(2 * half, sources),
      slope_(sources),
      step_(sources),
      trial_phi_(sources),
      before_(sources),
      table_(grid_table(half)),
      product_(2 * half),
      correlation_(table_.rows()),
      gain_(table_.rows()),
      room_(table_.rows()),
      residual_(2 * half) {}

void GroupFit::set_sources(const MatrixXd& sources) { sources_ = sources; }

void GroupFit::shift_all(const double* phi, bool derivative) {
  for (Index k = 0; k < k_; ++k) {
    shift_spectrum(sources_.col(k).data(), phi[k], half_, z_.col(k).data(),
                   derivative ? dz_.col(k).data() : nullptr);
  }
}

void GroupFit::solve_weights(const double* x, double* w) {
  inner_products(z_.data(), k_, z_.data(), k_, 2 * half_, gram_.data());
  inner_products(z_.data(), k_, x, p_, 2 * half_, y_.data());
  factor_ = gram_;
  factor_.diagonal().array() += kRidge * (gram_.trace() / static_cast<double>(k_)) + 1e-300;
  Eigen::LLT<Eigen::Ref<MatrixXd>> llt(factor_);
  Eigen::Map<MatrixXd> weights(w, k_, p_);
  weights = y_;
  llt.solveInPlace(weights);
  if (nonnegative_) {
    for (Index i = 0; i < p_; ++i) clip_and_descend(gram_, y_.col(i).data(), weights.col(i));
  }
}

double GroupFit::error(double energy, const double* w) const {
  // Σ‖x − Zw‖² = Σ‖x‖² − Σ w·(2y − Gw)
  double explained = 0.0;
  for (Index i = 0; i < p_; ++i) {
    for (Index k = 0; k < k_; ++k) {
      double gw = 0.0;
      for (Index l = 0; l < k_; ++l) gw += gram_(l, k) * w[l + i * k_];
      explained += w[k + i * k_] * (2.0 * y_(k, i) - gw);
    }
  }
  return energy - explained;
}

double GroupFit::weights(const double* x, double energy, const double* phi, double* w) {
  shift_all(phi, false);
  solve_weights(x, w);
  return error(energy, w);
}

void GroupFit::normal_equations(const double* x, const double* w) {
  const Index length = 2 * half_;
  inner_products(dz_.data(), k_, z_.data(), k_, length, cross_.data());
  inner_products(dz_.data(), k_, dz_.data(), k_, length, dgram_.data());
  inner_products(dz_.data(), k_, x, p_, length, dy_.data());
  const Eigen::Map<const MatrixXd> weights(w, k_, p_);
  moment_.noalias() = weights.lazyProduct(weights.transpose());
  // slope: Σᵢ wₖᵢ⟨dzₖ, rᵢ⟩ with r = x − Zw; curvature: (WWᵀ) ∘ dZᵀP⊥dZ
  for (Index k = 0; k < k_; ++k) {
    slope_[k] = weights.row(k).dot(dy_.row(k)) - cross_.row(k).dot(moment_.row(k));
  }
  if (!nonnegative_) {  // with bounds the weights do not follow freely: no projection
    damped_ = cross_.transpose();
    factor_.triangularView<Eigen::Lower>().solveInPlace(damped_);
    dgram_.noalias() -= damped_.transpose().lazyProduct(damped_);
  }
  curvature_ = moment_.cwiseProduct(dgram_);
}

double GroupFit::refine(const double* x, double energy, double* phi, double* w, int steps) {
  shift_all(phi, true);
  solve_weights(x, w);
  double e = error(energy, w), lambda = 1e-3;
  bool fresh = true;
  const Index free = k_ - frozen_;
  for (int i = 0; i < steps && free > 0; ++i) {
    if (fresh) normal_equations(x, w);
    auto a = damped_.bottomRightCorner(free, free);
    a = curvature_.bottomRightCorner(free, free);
    const double floor = 1e-12 * a.diagonal().maxCoeff() + 1e-300;
    a.diagonal() = a.diagonal() * (1.0 + lambda) + VectorXd::Constant(free, floor);
    Eigen::LLT<Eigen::Ref<MatrixXd>> llt(a);
    auto step = step_.tail(free);
    step = slope_.tail(free);
    llt.solveInPlace(step);
    if (llt.info() != Eigen::Success || !step.allFinite()) break;
    for (Index k = 0; k < k_; ++k) {
      trial_phi_[k] = phi[k] + (k < frozen_ ? 0.0 : std::clamp(step_[k], -kMaxStep, kMaxStep));
    }
    shift_all(trial_phi_.data(), true);
    solve_weights(x, trial_w_.data());
    const double tried = error(energy, trial_w_.data());
    fresh = tried < e;
    if (fresh) {
      std::copy_n(trial_phi_.data(), k_, phi);
      std::copy_n(trial_w_.data(), k_ * p_, w);
      e = tried;
      lambda *= 0.1;
    } else {
      lambda = std::max(10.0 * lambda, 0.1);
    }
  }
  return e;
}

void GroupFit::add_correlation(const double* v, Index k) {
  // ⟨v, sₖ(τⱼ)⟩ = Re Σ e^{ifτⱼ} conj(Sₖ) v
  const auto s = sources_.col(k);
  const Eigen::Map<const VectorXd> in(v, 2 * half_);
  product_.head(half_) =
      s.head(half_).cwiseProduct(in.head(half_)) + s.tail(half_).cwiseProduct(in.tail(half_));
  product_.tail(half_) =
      s.head(half_).cwiseProduct(in.tail(half_)) - s.tail(half_).cwiseProduct(in.head(half_));
  trigonometric_sum(table_.data(), product_.data(), table_.rows(), 2 * half_, correlation_.data());
}

Index GroupFit::best_on_grid(const double* x, Index k, const double* w) {
  const double energy = sources_.col(k).squaredNorm();
  gain_.setZero();
  room_.setConstant(energy);
  const Index others = k_ - 1;
  auto basis = basis_.leftCols(others);
  auto gram = factor_.topLeftCorner(others, others);
  for (Index l = 0, o = 0; l < k_; ++l) {
    if (l != k) basis.col(o++) = z_.col(l);
  }
  if (nonnegative_) {  // the others keep their weights
    for (Index i = 0; i < p_; ++i) {
      residual_ = Eigen::Map<const VectorXd>(x + i * 2 * half_, 2 * half_);
      for (Index l = 0; l < k_; ++l) {
        if (l != k) residual_ -= w[l + i * k_] * z_.col(l);
      }
      add_correlation(residual_.data(), k);
      gain_.array() += correlation_.array().max(0.0).square();
    }
  } else {
    // an orthonormal basis of the others: what it takes is theirs
    inner_products(basis_.data(), others, basis_.data(), others, 2 * half_, damped_.data());
    gram = Eigen::Map<MatrixXd>(damped_.data(), others, others);
    gram.diagonal().array() += kRidge;
    Eigen::LLT<Eigen::Ref<MatrixXd>> llt(gram);
    if (others > 0) {
      gram.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(basis);
    }
    for (Index o = 0; o < others; ++o) {
      add_correlation(basis.col(o).data(), k);
      room_.array() -= correlation_.array().square();
    }
    for (Index i = 0; i < p_; ++i) {
      residual_ = Eigen::Map<const VectorXd>(x + i * 2 * half_, 2 * half_);
      for (Index o = 0; o < others; ++o) {
        residual_ -= basis.col(o).dot(residual_) * basis.col(o);
      }
      add_correlation(residual_.data(), k);
      gain_.array() += correlation_.array().square();
    }
  }
  gain_.array() /= room_.array().max(1e-3 * energy + 1e-300);
  Index best = 0;
  gain_.maxCoeff(&best);
  return best;
}

double GroupFit::search(const double* x, double energy, double* phi, double* w) {
  double e = weights(x, energy, phi, w);
  const double spacing = math::kTwoPi / static_cast<double>(table_.rows());
  for (Index k = frozen_; k < k_; ++k) {
    const Index j = best_on_grid(x, k, w);
    const double found = math::wrap_pi(static_cast<double>(j) * spacing);
    if (std::abs(math::wrap_pi(found - phi[k])) < spacing) continue;
    std::copy_n(phi, k_, trial_phi_.data());
    trial_phi_[k] = found;
    const double tried = weights(x, energy, trial_phi_.data(), trial_w_.data());
    if (tried < e) {
      phi[k] = found;
      std::copy_n(trial_w_.data(), k_ * p_, w);
      e = tried;
    } else {
      shift_all(phi, false);
    }
  }
  return e;
}

}  // namespace mimesis::demix
