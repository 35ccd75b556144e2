#include "nodes/vision/hand/cma_es.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace mimesis::vision {
namespace {

constexpr std::size_t kDeviates = 1u << 15;  // normal deviates, read from random places
constexpr int kFactorEvery = 4;              // generations for which a factor of C serves

}  // namespace

CmaEs::CmaEs(int dimensions, int population, std::uint64_t seed)
    : n_(static_cast<std::size_t>(dimensions)),
      lambda_(population),
      mu_(population / 2),
      random_(seed) {
  const double n = dimensions;
  weights_.resize(static_cast<std::size_t>(mu_));
  for (int k = 0; k < mu_; ++k) {
    weights_[static_cast<std::size_t>(k)] = std::log(0.5 * (lambda_ + 1)) - std::log(k + 1.0);
  }
  const double sum = std::accumulate(weights_.begin(), weights_.end(), 0.0);
  double squares = 0.0;
  for (double& w : weights_) {
    w /= sum;
    squares += w * w;
  }
  // The tutorial's default settings.
  mu_eff_ = 1.0 / squares;
  c_sigma_ = (mu_eff_ + 2.0) / (n + mu_eff_ + 5.0);
  d_sigma_ = 1.0 + 2.0 * std::max(0.0, std::sqrt((mu_eff_ - 1.0) / (n + 1.0)) - 1.0) + c_sigma_;
  c_c_ = (4.0 + mu_eff_ / n) / (n + 4.0 + 2.0 * mu_eff_ / n);
  c_1_ = 2.0 / ((n + 1.3) * (n + 1.3) + mu_eff_);
  c_mu_ = std::min(1.0 - c_1_,
                   2.0 * (mu_eff_ - 2.0 + 1.0 / mu_eff_) / ((n + 2.0) * (n + 2.0) + mu_eff_));
  chi_n_ = std::sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));
  deviates_.resize(kDeviates);
  for (double& d : deviates_) {  // Box & Muller
    const double a = static_cast<double>((random_() >> 11) + 1) * 0x1.0p-53;
    const double b = static_cast<double>(random_() >> 11) * 0x1.0p-53;
    d = std::sqrt(-2.0 * std::log(a)) * std::cos(2.0 * std::numbers::pi * b);
  }
  const std::size_t rows = static_cast<std::size_t>(lambda_) * n_;
  for (auto* m : {&z_, &y_, &x_}) m->resize(rows);
  for (auto* v : {&mean_, &path_c_, &path_sigma_, &mean_z_, &mean_y_}) v->resize(n_);
  covariance_.resize(n_ * n_);
  factor_.resize(n_ * n_);
  order_.resize(static_cast<std::size_t>(lambda_));
}

void CmaEs::begin(std::span<const double> mean, double sigma) {
  std::copy(mean.begin(), mean.end(), mean_.begin());
  std::fill(path_c_.begin(), path_c_.end(), 0.0);
  std::fill(path_sigma_.begin(), path_sigma_.end(), 0.0);
  sigma_ = sigma;
  generation_ = 0;
  factorize();
}

void CmaEs::start(std::span<const double> mean, double sigma) {
  std::fill(covariance_.begin(), covariance_.end(), 0.0);
  for (std::size_t i = 0; i < n_; ++i) covariance_[i * n_ + i] = 1.0;
  begin(mean, sigma);
}

void CmaEs::resume(std::span<const double> mean, double sigma, double forget) {
  double trace = 0.0;
  for (std::size_t i = 0; i < n_; ++i) trace += covariance_[i * n_ + i];
  if (!(trace > 0.0)) return start(mean, sigma);
  const double keep = (1.0 - forget) * static_cast<double>(n_) / trace;
  for (double& c : covariance_) c *= keep;
  for (std::size_t i = 0; i < n_; ++i) covariance_[i * n_ + i] += forget;
  begin(mean, sigma);
}

/// Lower triangle L with L Lᵀ = C.
void CmaEs::factorize() {
  for (std::size_t i = 0; i < n_; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = covariance_[i * n_ + j];
      for (std::size_t k = 0; k < j; ++k) sum -= factor_[i * n_ + k] * factor_[j * n_ + k];
      factor_[i * n_ + j] = i == j ? std::sqrt(std::max(sum, 1e-12)) : sum / factor_[j * n_ + j];
    }
  }
}

void CmaEs::ask() {
  for (std::size_t k = 0; k < static_cast<std::size_t>(lambda_); ++k) {
    const double* deviates = deviates_.data() + random_() % (kDeviates - n_);
    double *z = z_.data() + k * n_, *y = y_.data() + k * n_, *x = x_.data() + k * n_;
    for (std::size_t i = 0; i < n_; ++i) {
      z[i] = deviates[i];
      double sum = 0.0;
      for (std::size_t j = 0; j <= i; ++j) sum += factor_[i * n_ + j] * z[j];
      y[i] = sum;
      x[i] = mean_[i] + sigma_ * sum;
    }
  }
}

void CmaEs::tell(std::span<const double> cost) {
  std::iota(order_.begin(), order_.end(), 0);
  std::sort(order_.begin(), order_.end(), [&cost](int a, int b) {
    const double ca = cost[static_cast<std::size_t>(a)], cb = cost[static_cast<std::size_t>(b)];
    return ca < cb || (ca == cb && a < b);
  });
  ++generation_;
  std::fill(mean_z_.begin(), mean_z_.end(), 0.0);
  std::fill(mean_y_.begin(), mean_y_.end(), 0.0);
  for (std::size_t k = 0; k < static_cast<std::size_t>(mu_); ++k) {
    const std::size_t at = static_cast<std::size_t>(order_[k]) * n_;
    for (std::size_t i = 0; i < n_; ++i) {
      mean_z_[i] += weights_[k] * z_[at + i];
      mean_y_[i] += weights_[k] * y_[at + i];
    }
  }
  double length2 = 0.0;
  for (std::size_t i = 0; i < n_; ++i) {
    mean_[i] += sigma_ * mean_y_[i];
    path_sigma_[i] = (1.0 - c_sigma_) * path_sigma_[i] +
                     std::sqrt(c_sigma_ * (2.0 - c_sigma_) * mu_eff_) * mean_z_[i];
    length2 += path_sigma_[i] * path_sigma_[i];
  }
  const double length = std::sqrt(length2);
  const double begun = 1.0 - std::pow(1.0 - c_sigma_, 2.0 * generation_);
  const bool rising =
      length / std::sqrt(begun) < (1.4 + 2.0 / (static_cast<double>(n_) + 1.0)) * chi_n_;
  for (std::size_t i = 0; i < n_; ++i) {
    path_c_[i] = (1.0 - c_c_) * path_c_[i] +
                 (rising ? std::sqrt(c_c_ * (2.0 - c_c_) * mu_eff_) * mean_y_[i] : 0.0);
  }
  const double keep = 1.0 - c_1_ - c_mu_ + (rising ? 0.0 : c_1_ * c_c_ * (2.0 - c_c_));
  for (std::size_t i = 0; i < n_; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = keep * covariance_[i * n_ + j] + c_1_ * path_c_[i] * path_c_[j];
      for (std::size_t k = 0; k < static_cast<std::size_t>(mu_); ++k) {
        const double* y = y_.data() + static_cast<std::size_t>(order_[k]) * n_;
        sum += c_mu_ * weights_[k] * y[i] * y[j];
      }
      covariance_[i * n_ + j] = covariance_[j * n_ + i] = sum;
    }
  }
  sigma_ *= std::exp(c_sigma_ / d_sigma_ * (length / chi_n_ - 1.0));
  if (generation_ % kFactorEvery == 0) factorize();
}

}  // namespace mimesis::vision
