#include "common/motion/demix/grid_search.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "common/motion/demix/shift_kernels.h"
#include "common/motion/demix/small_cholesky.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Eigen::VectorXi;

constexpr float kRidge = 1e-6f;      // of a source's energy: two sources may coincide
constexpr float kLeastRoom = 1e-3f;  // a source that is nearly another one gains nothing
constexpr int kSweeps = 4;
constexpr Index kGrid = 64;  // places a period: Levenberg steps go on from there

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
  // the data at unit norm: what is looked up does not depend on its unit, and floats hold it
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
  small_cholesky(factor_, n, kRidge);
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
  small_cholesky(factor_, k_, kRidge);
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

}  // namespace mimesis::demix
