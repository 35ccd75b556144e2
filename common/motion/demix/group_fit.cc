#include "common/motion/demix/group_fit.h"

#include <algorithm>
#include <cmath>

#include "common/motion/demix/shift_kernels.h"
#include "common/motion/demix/small_cholesky.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kRidge = 1e-9;   // of a source's energy: two sources may coincide
constexpr double kMaxStep = 0.5;  // of a Levenberg step [rad]
constexpr int kStepsAfterSearch = 2;

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

GroupFit::GroupFit(Index half, Index sources, Index group, Index frozen, bool nonnegative,
                   std::uint32_t seed)
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
      found_w_(sources, group),
      slope_(sources),
      step_(sources),
      trial_phi_(sources),
      found_(sources),
      grid_(half, sources, group, frozen, nonnegative, seed) {}

void GroupFit::set_sources(const MatrixXd& sources) {
  sources_ = sources;
  grid_.set_sources(sources);
}

void GroupFit::shift_all(const double* phi, bool derivative) {
  for (Index k = 0; k < k_; ++k) {
    shift_spectrum(sources_.col(k).data(), phi[k], half_, z_.col(k).data(),
                   derivative ? dz_.col(k).data() : nullptr);
  }
}

void GroupFit::solve_weights(const double* x, double* w) {
  gram_matrix(z_.data(), k_, 2 * half_, gram_.data());
  inner_products(z_.data(), k_, x, p_, 2 * half_, y_.data());
  factor_ = gram_;
  small_cholesky(factor_, k_, kRidge * (gram_.trace() / static_cast<double>(k_)) + 1e-300);
  Eigen::Map<MatrixXd> weights(w, k_, p_);
  weights = y_;
  for (Index i = 0; i < p_; ++i) small_solve(factor_, k_, w + i * k_);
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
  gram_matrix(dz_.data(), k_, length, dgram_.data());
  inner_products(dz_.data(), k_, x, p_, length, dy_.data());
  const Eigen::Map<const MatrixXd> weights(w, k_, p_);
  moment_.noalias() = weights.lazyProduct(weights.transpose());
  // slope: Σᵢ wₖᵢ⟨dzₖ, rᵢ⟩ with r = x − Zw; curvature: (WWᵀ) ∘ dZᵀP⊥dZ
  for (Index k = 0; k < k_; ++k) {
    slope_[k] = weights.row(k).dot(dy_.row(k)) - cross_.row(k).dot(moment_.row(k));
  }
  if (!nonnegative_) {  // with bounds the weights do not follow freely: no projection
    damped_ = cross_.transpose();
    for (Index k = 0; k < k_; ++k) small_forward(factor_, k_, damped_.col(k).data());
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
    a.diagonal() *= 1.0 + lambda;
    small_cholesky(a, free, floor);
    step_ = slope_;
    small_solve(a, free, step_.data() + frozen_);
    if (!step_.allFinite()) break;
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

double GroupFit::search(const double* x, double energy, double* phi, double* w, int restarts) {
  const double e = refine(x, energy, phi, w, kStepsAfterSearch);
  if (!grid_.propose(x, phi, restarts, found_.data())) return e;
  const double tried = refine(x, energy, found_.data(), found_w_.data(), kStepsAfterSearch);
  if (!(tried < e)) return e;
  std::copy_n(found_.data(), k_, phi);
  std::copy_n(found_w_.data(), k_ * p_, w);
  return tried;
}

}  // namespace mimesis::demix
