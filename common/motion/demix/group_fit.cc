#include "common/motion/demix/group_fit.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Eigen::VectorXi;

constexpr float kGridRidge = 1e-6f;  // share of a source's energy: two sources may coincide
constexpr float kLeastRoom = 1e-3f;  // a source that is nearly another one gains nothing
constexpr int kSweeps = 4;
constexpr Index kGrid = 64;  // places per period: Levenberg steps continue from there

constexpr double kRidge = 1e-9;   // share of a source's energy: two sources may coincide
constexpr double kMaxStep = 0.5;  // longest Levenberg step [rad]
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

GridSearch::GridSearch(Index half, Index sources, Index group, Index frozen, bool nonnegative,
                       std::uint32_t seed)
    : half_(half),
      k_(sources),
      p_(group),
      frozen_(frozen),
      grid_(kGrid),
      nonnegative_(nonnegative),
      angles_(grid_),
      table_(grid_ / 4, 2 * half),
      order_(static_cast<std::size_t>(grid_)),
      sources_(2 * half, sources),
      product_(2 * half),
      mirrored_(grid_),
      between_(2 * grid_, sources * sources),
      with_data_(grid_, sources * group),
      scratch_(16 * sources + grid_),
      factor_(sources, sources),
      weight_(sources, group),
      others_(static_cast<std::size_t>(sources)),
      place_(sources),
      best_(sources),
      random_(seed) {
  const Index quarter = grid_ / 4;
  const double spacing = math::kTwoPi / static_cast<double>(grid_);
  for (Index i = 0; i < quarter; ++i) {
    const Index places[] = {i, grid_ - 1 - i, grid_ / 2 - 1 - i, grid_ / 2 + i};
    for (Index q = 0; q < 4; ++q) {
      order_[static_cast<std::size_t>(places[q])] = q * quarter + i;
    }
    for (Index f = 0; f < half; ++f) {
      const double turned = static_cast<double>(f + 1) * (static_cast<double>(i) + 0.5) * spacing;
      table_(i, 2 * f) = std::cos(turned);
      table_(i, 2 * f + 1) = std::sin(turned);
    }
  }
  for (Index j = 0; j < grid_; ++j) {
    angles_[j] = math::wrap_pi((static_cast<double>(j) + 0.5) * spacing);
  }
}

void GridSearch::set_sources(const MatrixXd& sources) {
  sources_ = sources;
  VectorXd cosine(grid_), sine(grid_), column(grid_);
  for (Index j = 0; j < grid_; ++j) {
    const double angle = math::kTwoPi * static_cast<double>(j) / static_cast<double>(grid_);
    cosine[j] = std::cos(angle);
    sine[j] = std::sin(angle);
  }
  for (Index k = 0; k < k_; ++k) {
    for (Index l = 0; l < k_; ++l) {
      // ⟨sₖ(τ + Δ), sₗ(τ)⟩ = Re Σ e^{ifΔ} conj(Sₖ) Sₗ
      column.setZero();
      for (Index f = 0; f < half_; ++f) {
        const double a = sources(f, k), b = sources(half_ + f, k);
        const double c = sources(f, l), d = sources(half_ + f, l);
        const double re = a * c + b * d, im = a * d - b * c;
        for (Index j = 0; j < grid_; ++j) {
          const Index turned = (f + 1) * j % grid_;
          column[j] += re * cosine[turned] - im * sine[turned];
        }
      }
      between_.col(k + l * k_) << column.cast<float>(), column.cast<float>();
    }
  }
}

void GridSearch::correlate_data(const double* x) {
  // the data at unit norm: results do not depend on its unit, and floats hold it
  const double norm = Eigen::Map<const VectorXd>(x, p_ * 2 * half_).norm();
  const double scale = norm > 0.0 ? 1.0 / norm : 0.0;
  for (Index i = 0; i < p_; ++i) {
    const Eigen::Map<const VectorXd> in(x + i * 2 * half_, 2 * half_);
    for (Index k = 0; k < k_; ++k) {
      const auto s = sources_.col(k);  // ⟨x, sₖ(τ)⟩ = Re Σ e^{ifτ} conj(Sₖ) x
      product_.head(half_) =
          s.head(half_).cwiseProduct(in.head(half_)) + s.tail(half_).cwiseProduct(in.tail(half_));
      product_.tail(half_) =
          s.head(half_).cwiseProduct(in.tail(half_)) - s.tail(half_).cwiseProduct(in.head(half_));
      correlate(table_.data(), product_.data(), grid_ / 4, half_, mirrored_.data());
      float* out = with_data_.col(k * p_ + i).data();
      for (Index j = 0; j < grid_; ++j) {
        out[j] = static_cast<float>(scale * mirrored_[order_[static_cast<std::size_t>(j)]]);
      }
    }
  }
}

float GridSearch::gram(Index k, Index l, const VectorXi& place) const {
  return between_((place[k] - place[l] + grid_) % grid_, k + l * k_);
}

void GridSearch::best_place(VectorXi& place, Index k, bool& moved) {
  Index n = 0;
  for (Index l = 0; l < k_; ++l) {
    if (l == k) continue;
    // row n of the others' Gram matrix; their correlation with source k as it moves
    for (Index q = 0, m = 0; q <= l; ++q) {
      if (q != k) factor_(n, m++) = gram(l, q, place);
    }
    others_[static_cast<std::size_t>(n)] =
        between_.col(k + l * k_).data() + (grid_ - place[l]) % grid_;
    for (Index i = 0; i < p_; ++i) weight_(n, i) = with_data_(place[l], l * p_ + i);
    ++n;
  }
  small_cholesky(factor_, n, kGridRidge);
  for (Index i = 0; i < p_; ++i) small_forward(factor_, n, weight_.col(i).data());
  const float energy = between_(0, k + k * k_);
  const int found = best_gain({.others = others_.data(),
                               .count = n,
                               .factor = factor_.data(),
                               .stride = k_,
                               .weight = weight_.data(),
                               .data = with_data_.col(k * p_).data(),
                               .group = p_,
                               .grid = grid_,
                               .energy = energy,
                               .least_room = kLeastRoom * energy + 1e-30f,
                               .nonnegative = nonnegative_},
                              place[k], scratch_.data());
  moved = moved || found != place[k];
  place[k] = found;
}

void GridSearch::descend(VectorXi& place) {
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    bool moved = false;
    for (Index k = frozen_; k < k_; ++k) best_place(place, k, moved);
    if (!moved) return;
  }
}

float GridSearch::explained(const VectorXi& place) {
  for (Index k = 0; k < k_; ++k) {
    for (Index l = 0; l <= k; ++l) factor_(k, l) = gram(k, l, place);
  }
  small_cholesky(factor_, k_, kGridRidge);
  float sum = 0.0f;
  for (Index i = 0; i < p_; ++i) {
    for (Index k = 0; k < k_; ++k) weight_(k, i) = with_data_(place[k], k * p_ + i);
    small_forward(factor_, k_, weight_.col(i).data());
    sum += weight_.col(i).squaredNorm();
  }
  return sum;
}

int GridSearch::nearest(double phi) const {
  const auto steps = static_cast<int>(
      std::floor(math::wrap_two_pi(phi) / math::kTwoPi * static_cast<double>(grid_)));
  return std::min(steps, static_cast<int>(grid_) - 1);
}

bool GridSearch::propose(const double* x, const double* phi, int restarts, double* found) {
  correlate_data(x);
  for (Index k = 0; k < k_; ++k) best_[k] = nearest(phi[k]);
  place_ = best_;
  float most = explained(best_);
  bool better = false;
  for (int restart = 0; restart <= restarts; ++restart) {
    if (restart > 0) {
      for (Index k = frozen_; k < k_; ++k) {
        random_ = random_ * 1664525u + 1013904223u;  // Numerical Recipes' generator
        place_[k] = static_cast<int>((random_ >> 16) % static_cast<std::uint32_t>(grid_));
      }
    }
    descend(place_);
    const float now = explained(place_);
    if (now <= most) continue;
    most = now;
    best_ = place_;
    better = true;
  }
  for (Index k = 0; k < k_; ++k) found[k] = k < frozen_ ? phi[k] : angles_[best_[k]];
  return better;
}

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

// W-update [M18 3.3.3]: ZᵀZ w = Zᵀx for every trajectory of the group.
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
