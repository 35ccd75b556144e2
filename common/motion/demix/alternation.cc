#include "common/motion/demix/alternation.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/math/circle.h"
#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Harmonics in the order in which they are used, from 0.
std::vector<Index> ranking(const MatrixXd& data, bool by_energy) {
  const Index half = data.rows() / 2;
  const Eigen::VectorXd energy =
      data.topRows(half).rowwise().squaredNorm() + data.bottomRows(half).rowwise().squaredNorm();
  std::vector<Index> order(static_cast<std::size_t>(half));
  std::iota(order.begin(), order.end(), 0);
  if (by_energy) {
    std::ranges::stable_sort(order, [&](Index a, Index b) { return energy[a] > energy[b]; });
  }
  return order;
}

/// @param order  places in the ranking, from 1
Start harmonics(const std::vector<int>& order, const std::vector<Index>& ranks) {
  const auto half = static_cast<Index>(ranks.size());
  Start out{MatrixXd::Zero(2 * half, static_cast<Index>(order.size())), true};
  for (Index k = 0; k < out.sources.cols(); ++k) {
    const auto place = static_cast<std::size_t>(order[static_cast<std::size_t>(k)] - 1);
    out.sources(ranks[place % ranks.size()], k) = 1.0;
  }
  return out;
}

/// The first `doubled` harmonics twice, then the following ones once.
std::vector<int> with_pairs(Index count, Index doubled) {
  std::vector<int> order;
  for (int h = 1; static_cast<Index>(order.size()) < count; ++h) {
    order.push_back(h);
    if (h <= doubled && static_cast<Index>(order.size()) < count) order.push_back(h);
  }
  return order;
}

Start principal_components(const MatrixXd& data, Index count) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(data * data.transpose());
  return {solver.eigenvectors().rightCols(count).rowwise().reverse(), false};
}

using Eigen::VectorXd;

/// The phase by which a source has to be delayed.
double turn_to_crest(const VectorXd& spectrum) {
  const Index half = spectrum.size() / 2;
  Index dominant = 0;
  (spectrum.head(half).array().square() + spectrum.tail(half).array().square()).maxCoeff(&dominant);
  const auto order = static_cast<double>(dominant + 1);
  const double phase = std::atan2(spectrum[half + dominant], spectrum[dominant]);
  double best = 0.0, highest = -INFINITY;
  VectorXd turned(2 * half);
  for (Index i = 0; i <= dominant; ++i) {
    const double delay = (phase + math::kTwoPi * static_cast<double>(i)) / order;
    shift_spectrum(spectrum.data(), delay, half, turned.data(), nullptr);
    const double at_zero = turned.head(half).sum();
    if (at_zero > highest + 1e-9) {
      highest = at_zero;
      best = delay;
    }
  }
  return best;
}

void turn_and_scale(Mixture& m, Index k, bool keep_sign) {
  const Index samples = m.sources.cols(), harmonics = harmonic_count(samples);
  const Index half = (harmonics + 3) / 4 * 4;
  VectorXd spectrum = to_spectrum(m.sources.row(k), harmonics, half), turned(2 * half);
  double scale = spectrum.norm() / std::sqrt(static_cast<double>(samples));
  if (scale <= 0.0) return;
  if (!keep_sign && m.weights.col(k).sum() < 0.0) scale = -scale;
  spectrum /= scale;
  const double delay = turn_to_crest(spectrum);
  shift_spectrum(spectrum.data(), delay, half, turned.data(), nullptr);
  m.sources.row(k) = from_spectrum(turned, samples);
  m.weights.col(k) *= scale;
  m.delay_rad.col(k).array() -= delay;
}

}  // namespace

std::vector<Start> starts(const MatrixXd& data, Index count, bool tied, bool by_energy) {
  if (count == 0) return {{MatrixXd(data.rows(), 0), false}};
  const std::vector<Index> ranks = ranking(data, by_energy);
  std::vector<Start> out;
  out.push_back(harmonics(with_pairs(count, 0), ranks));
  if (!tied) return out;
  for (Index doubled = 1; doubled <= (count + 1) / 2; ++doubled) {
    if (with_pairs(count, doubled) == with_pairs(count, doubled - 1)) break;
    out.push_back(harmonics(with_pairs(count, doubled), ranks));
  }
  out.push_back(principal_components(data, count));
  return out;
}

void Anderson::clear() {
  value_.clear();
  residual_.clear();
}

Eigen::MatrixXd Anderson::next(const Eigen::MatrixXd& x, const Eigen::MatrixXd& gx) {
  value_.emplace_back(gx.reshaped());
  residual_.emplace_back((gx - x).reshaped());
  if (value_.size() > memory_) {
    value_.pop_front();
    residual_.pop_front();
  }
  const auto past = static_cast<Eigen::Index>(value_.size()) - 1;
  if (past == 0) return gx;
  // min ‖rₙ − ΔR γ‖, next = gₙ − ΔG γ
  Eigen::MatrixXd dr(gx.size(), past), dg(gx.size(), past);
  for (Eigen::Index i = 0; i < past; ++i) {
    const auto j = static_cast<std::size_t>(i);
    dr.col(i) = residual_[j + 1] - residual_[j];
    dg.col(i) = value_[j + 1] - value_[j];
  }
  Eigen::MatrixXd normal = dr.transpose() * dr;
  normal.diagonal().array() += 1e-10 * normal.trace() + 1e-300;
  const Eigen::VectorXd gamma = normal.ldlt().solve(dr.transpose() * residual_.back());
  const Eigen::VectorXd mixed = value_.back() - dg * gamma;
  return mixed.reshaped(gx.rows(), gx.cols());
}

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
  // S-update [M18 3.3.3]: A(f) s(f) = b(f), the frozen sources' share on the right
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

void fix_gauge(Mixture& mixture, Index given, bool keep_signs) {
  const Index count = mixture.sources.rows();
  for (Index k = given; k < count; ++k) turn_and_scale(mixture, k, keep_signs);
  std::vector<Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  const VectorXd carried = mixture.weights.colwise().squaredNorm();
  std::stable_sort(order.begin() + given, order.end(),
                   [&](Index a, Index b) { return carried[a] > carried[b]; });
  mixture.sources = mixture.sources(order, Eigen::all).eval();
  mixture.weights = mixture.weights(Eigen::all, order).eval();
  mixture.delay_rad = mixture.delay_rad(Eigen::all, order).eval();
  for (Index k = given; k < count; ++k) {
    for (Index n = 0; n < mixture.weights.rows(); ++n) {
      mixture.delay_rad(n, k) =
          mixture.weights(n, k) == 0.0 ? 0.0 : math::wrap_pi(mixture.delay_rad(n, k));
    }
  }
}

}  // namespace mimesis::demix
