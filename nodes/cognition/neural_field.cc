#include "nodes/cognition/neural_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "common/error.h"
#include "nodes/cognition/exponential.h"

namespace mimesis::cognition {
namespace {

// Neurons whose sums are held in registers at once. Every loop below runs over whole blocks, so
// that it becomes vector code without changing the order of a single addition.
constexpr std::size_t kBlock = 16;

/// 16 bytes of neighbouring neurons (GCC and Clang): the compiler left to itself vectorises the sum
/// over the kernel along the wrong loop, at half the speed.
template <class Real>
struct Lanes {
  using Vector [[gnu::vector_size(16)]] = Real;
  static constexpr std::size_t kPerBlock = kBlock * sizeof(Real) / 16;

  static Vector load(const Real* from) {
    Vector v;
    std::memcpy(&v, from, sizeof v);
    return v;
  }
};

std::size_t whole_blocks(std::size_t n) { return (n + kBlock - 1) / kBlock * kBlock; }

/// out[x] = Σⱼ kernel[j] from[x + j·stride] − less, for x < n, a multiple of kBlock.
template <class Real>
void convolve(const std::vector<Real>& kernel, const Real* from, std::size_t stride, std::size_t n,
              Real less, Real* out) {
  using L = Lanes<Real>;
  constexpr std::size_t kLanes = kBlock / L::kPerBlock;
  const Real* __restrict weight = kernel.data();
  for (std::size_t x = 0; x < n; x += kBlock) {
    typename L::Vector sum[L::kPerBlock] = {};
    for (std::size_t j = 0; j < kernel.size(); ++j) {
      for (std::size_t i = 0; i < L::kPerBlock; ++i) {
        sum[i] += weight[j] * L::load(from + x + j * stride + i * kLanes);
      }
    }
    for (auto& s : sum) s -= less;
    std::memcpy(out + x, sum, sizeof sum);
  }
}

void check(bool ok, const char* what) {
  if (!ok) throw ConfigError(std::string("neural field: ") + what);
}

void check(const FieldParams& p, double dt_s) {
  check(p.neurons >= 2, "neurons must be at least 2");
  check(p.rows >= 1, "rows must be at least 1");
  check(p.rows == 1 || static_cast<std::size_t>(p.neurons) % kBlock == 0,
        "neurons must be a multiple of 16 in a 2-D field");
  check(p.dx > 0.0, "dx must be positive");
  check(p.tau_s > 0.0, "tau_s must be positive");
  check(p.resting_level < 0.0, "resting_level must be negative");
  check(p.slope > 0.0, "slope must be positive");
  check(p.width > 0.0, "width must be positive");
  check(p.decay >= 0.0, "decay must not be negative");
  if (p.decay > 0.0) {
    check(p.threshold1 >= p.threshold2, "threshold1 must not be below threshold2 [M18 eq. 2.6]");
    check(p.inhibition >= 0.0, "inhibition must not be negative");
    check(p.decay_tau_s > p.tau_s, "expected decay_tau_s > tau_s: inhibition follows excitation");
    check(p.decay_width > p.width, "expected decay_width > width [M18 2.5]");
  } else {
    check(p.threshold1 > p.threshold2, "threshold1 must be above threshold2 [M18 eq. 2.2]");
    check(p.inhibition > 0.0, "inhibition must be positive");
  }
  check(dt_s > 0.0 && dt_s <= p.tau_s, "the step must be positive and at most tau_s");
}

}  // namespace

template <class Real>
NeuralField<Real>::NeuralField(const FieldParams& params, double dt_s)
    : params_(params), dt_s_(dt_s) {
  check(params, dt_s);
  columns_ = whole_blocks(static_cast<std::size_t>(params.neurons));
  rows_ = static_cast<std::size_t>(params.rows);
  size_ = static_cast<std::size_t>(params.neurons) * rows_;
  padded_ = columns_ * rows_;
  excitation_ = kernel(params.excitation, params.width);
  if (transient()) decay_ = kernel(params.decay, params.decay_width);
  halo_ = std::max(excitation_.left, decay_.left);
  relaxation_ = static_cast<Real>(dt_s / params.tau_s);
  beta_ = static_cast<Real>(params.slope);
  shift1_ = static_cast<Real>(std::exp(params.slope * params.threshold1));
  shift2_ = static_cast<Real>(std::exp(params.slope * params.threshold2));
  for (auto* v : {&u_, &input_, &gate_, &rate_, &lateral_, &rise_}) v->resize(padded_);
  if (transient()) {
    for (auto* v : {&v_, &drive_}) v->resize(padded_);
  }
  row_.resize(columns_ + 2 * halo_);
  if (rows_ > 1) along_x_.resize(columns_ * (rows_ + 2 * halo_));
  reset();
}

template <class Real>
typename NeuralField<Real>::Kernel NeuralField<Real>::kernel(double amplitude, double width) const {
  const double dx = params_.dx;
  Kernel w;
  w.left = static_cast<std::size_t>(std::ceil(kCutoff * width / dx));
  for (std::size_t i = 0; i <= 2 * w.left; ++i) {
    const double d = (static_cast<double>(i) - static_cast<double>(w.left)) * dx / width;
    w.x.push_back(static_cast<Real>(amplitude * std::exp(-0.5 * d * d) * dx));
    if (rows_ > 1) w.y.push_back(static_cast<Real>(std::exp(-0.5 * d * d) * dx));
  }
  return w;
}

template <class Real>
void NeuralField<Real>::reset() {
  std::ranges::fill(u_, static_cast<Real>(params_.resting_level));
  std::ranges::fill(input_, Real(0));
  std::ranges::fill(rise_, Real(0));
  std::ranges::fill(v_, Real(0));
  fire();
}

template <class Real>
void NeuralField<Real>::step() {
  interact();
  if (transient()) follow();
  const Real h = static_cast<Real>(params_.resting_level);
  const Real relaxation = relaxation_;
  Real* __restrict u = u_.data();
  Real* __restrict rise = rise_.data();
  Real* __restrict input = input_.data();
  const Real* __restrict gate = gate_.data();
  const Real* __restrict lateral = lateral_.data();
  for (std::size_t i = 0; i < padded_; ++i) {
    rise[i] = relaxation * (h - u[i] + input[i] + gate[i] * lateral[i]);
    u[i] += rise[i];
    input[i] = Real(0);
  }
  fire();
}

// β₁ = β₂, so one exponential serves both sigmoids: exp(−β(u − θ)) = exp(−βu)·exp(βθ).
template <class Real>
void NeuralField<Real>::fire() {
  const Real beta = beta_, shift1 = shift1_, shift2 = shift2_;
  const Real* __restrict u = u_.data();
  Real* __restrict gate = gate_.data();
  Real* __restrict rate = rate_.data();
  for (std::size_t i = 0; i < padded_; ++i) {
    const Real e = exponential(-beta * u[i]);
    gate[i] = Real(1) / (Real(1) + e * shift1);
    rate[i] = Real(1) / (Real(1) + e * shift2);
  }
  for (std::size_t i = size_; i < padded_; ++i) rate[i] = Real(0);  // the axis ends at N
}

template <class Real>
void NeuralField<Real>::interact() {
  std::array<Real, kBlock> partial{};  // sums of every 16th neuron
  const Real* __restrict rate = rate_.data();
  for (std::size_t x = 0; x < padded_; x += kBlock) {
    for (std::size_t i = 0; i < kBlock; ++i) partial[i] += rate[x + i];
  }
  Real total = 0;
  for (const Real p : partial) total += p;
  const double area = rows_ > 1 ? params_.dx * params_.dx : params_.dx;
  const Real inhibition = static_cast<Real>(params_.inhibition * area) * total;

  sum_rates(excitation_, inhibition, lateral_.data());
}

/// ∫ w f₂ − less
template <class Real>
void NeuralField<Real>::sum_rates(const Kernel& w, Real less, Real* sums) {
  const bool flat = rows_ > 1;
  const std::size_t inside = halo_ - w.left;  // zeros that this kernel does not reach
  Real* const along_x = flat ? along_x_.data() + halo_ * columns_ : sums;
  for (std::size_t y = 0; y < rows_; ++y) {
    std::copy_n(rate_.data() + y * columns_, columns_, row_.data() + halo_);
    convolve(w.x, row_.data() + inside, 1, columns_, flat ? Real(0) : less, along_x + y * columns_);
  }
  for (std::size_t y = 0; flat && y < rows_; ++y) {
    convolve(w.y, along_x_.data() + (y + inside) * columns_, columns_, columns_, less,
             sums + y * columns_);
  }
}

/// v acts on u as it is, then follows the same rates.
template <class Real>
void NeuralField<Real>::follow() {
  sum_rates(decay_, Real(0), drive_.data());
  const auto share = static_cast<Real>(dt_s_ / params_.decay_tau_s);
  const auto slope = static_cast<Real>(params_.decay_slope),
             threshold = static_cast<Real>(params_.decay_threshold);
  for (std::size_t i = 0; i < padded_; ++i) {
    lateral_[i] -= v_[i];
    const Real gate = Real(1) / (Real(1) + exponential(-slope * (v_[i] - threshold)));
    v_[i] += share * (gate * drive_[i] - v_[i]);
  }
}

template <class Real>
double NeuralField<Real>::speed_1_s() const {
  Real largest = 0;
  for (std::size_t i = 0; i < size_; ++i) largest = std::max(largest, std::abs(rise_[i]));
  return static_cast<double>(largest) / dt_s_;
}

template <class Real>
double NeuralField<Real>::f2(double u) const {
  const double x = params_.slope * (u - params_.threshold2);
  return 1.0 / (1.0 + std::exp(-x));
}

template class NeuralField<float>;
template class NeuralField<double>;

template <class Real>
Link<Real>::Pattern::Pattern(std::span<const Real> whole, Real factor, Real above) {
  const auto active = [above](Real r) { return r != 0 && r >= above; };
  const auto begin = std::ranges::find_if(whole, active);
  const auto end = std::find_if(whole.rbegin(), whole.rend(), active).base();
  first = static_cast<std::size_t>(begin - whole.begin());
  for (auto r = begin; r < end; ++r) rate.push_back(active(*r) ? factor * *r : Real(0));
}

template <class Real>
Link<Real>::Link(std::size_t targets, std::size_t sources, double dy, bool low_rank)
    : targets_(targets),
      sources_(sources),
      dy_(static_cast<Real>(dy)),
      low_rank_(low_rank),
      weights_(low_rank ? 0 : targets * sources),
      spans_(low_rank ? 0 : sources),
      shunt_(low_rank ? 0 : targets) {
  clear();
}

template <class Real>
void Link<Real>::clear() {
  pairs_.clear();
  std::ranges::fill(weights_, Real(0));
  std::ranges::fill(spans_, Span{targets_, 0});
}

template <class Real>
void Link<Real>::transmit(std::span<const Real> source_rate, std::span<Real> input) const {
  Real* __restrict s = input.data();
  for (const Pair& pair : pairs_) {
    const auto& [target, source] = pair;
    Real sum = 0;
    for (std::size_t y = 0; y < source.rate.size(); ++y) {
      sum += source.rate[y] * source_rate[source.first + y];
    }
    sum *= dy_;
    for (std::size_t x = 0; x < target.rate.size(); ++x)
      s[target.first + x] += target.rate[x] * sum;
  }
  for (std::size_t y = 0; y < spans_.size(); ++y) {
    const Real rate = source_rate[y] * dy_;
    const Real* __restrict column = weights_.data() + y * targets_;
    const auto [first, last] = spans_[y];
    for (std::size_t x = first; x < last; ++x) s[x] += column[x] * rate;
  }
}

template <class Real>
double Link<Real>::input_at(std::span<const Real> source_rate, std::size_t x) const {
  double sum = 0.0;
  for (std::size_t y = 0; y < sources_; ++y) {
    sum += static_cast<double>(weight(x, y) * source_rate[y]);
  }
  return sum * static_cast<double>(dy_);
}

template <class Real>
void Link<Real>::learn(std::span<const Real> target_rate, std::span<const Real> source_rate,
                       Real eta, Real fraction, Above above) {
  MIMESIS_ASSERT(fraction >= 0 && fraction <= 1 && !low_rank_);
  if (fraction == 0) return;
  const Span active = active_span(target_rate, above.target);
  for (std::size_t y = 0; y < sources_; ++y) {
    if (source_rate[y] < above.source) continue;
    widen(y, active);
    const auto [first, last] = spans_[y];
    Real* __restrict column = weights_.data() + y * targets_;
    const Real* __restrict target = target_rate.data();
    for (std::size_t x = first; x < last; ++x) {
      const Real change = fraction * (eta * target[x] * source_rate[y] - column[x]);
      column[x] += target[x] < above.target ? Real(0) : change;
    }
  }
}

template <class Real>
void Link<Real>::learn_shunted(std::span<const Real> target_activity,
                               std::span<const Real> target_rate, std::span<const Real> source_rate,
                               const ShuntedParams& rule, double dt_s) {
  MIMESIS_ASSERT(!low_rank_);
  const auto share = static_cast<Real>(dt_s / rule.tau_s), alpha = static_cast<Real>(rule.alpha),
             beta = static_cast<Real>(rule.beta), slope = static_cast<Real>(rule.slope),
             threshold = static_cast<Real>(rule.threshold);
  for (std::size_t x = 0; x < targets_; ++x) {
    shunt_[x] = Real(1) / (Real(1) + exponential(-slope * (target_activity[x] - threshold)));
  }
  const Real* __restrict shunt = shunt_.data();
  const Real* __restrict rate = target_rate.data();
  for (std::size_t y = 0; y < sources_; ++y) {
    Real* __restrict column = weights_.data() + y * targets_;
    const Real source = alpha * source_rate[y];
    for (std::size_t x = 0; x < targets_; ++x) {
      column[x] += share * (shunt[x] * (source * rate[x] - column[x]) - beta * column[x]);
    }
    spans_[y] = {0, targets_};
  }
}

template <class Real>
void Link<Real>::fill(Real weight) {
  MIMESIS_ASSERT(!low_rank_);
  std::ranges::fill(weights_, weight);
  std::ranges::fill(spans_, Span{0, targets_});
}

template <class Real>
void Link<Real>::install(std::span<const Real> target_rate, std::span<const Real> source_rate,
                         Real eta, Above above) {
  if (low_rank_) {
    pairs_.push_back({{target_rate, eta, above.target}, {source_rate, Real(1), above.source}});
    return;
  }
  const Span active = active_span(target_rate, above.target);
  for (std::size_t y = 0; y < sources_; ++y) {
    if (source_rate[y] < above.source) continue;
    widen(y, active);
    for (std::size_t x = 0; x < targets_; ++x) {
      if (target_rate[x] < above.target) continue;
      weights_[y * targets_ + x] += eta * target_rate[x] * source_rate[y];
    }
  }
}

template <class Real>
Real Link<Real>::weight(std::size_t x, std::size_t y) const {
  if (!low_rank_) return weights_[y * targets_ + x];
  Real sum = 0;
  for (const Pair& pair : pairs_) sum += pair.target.at(x) * pair.source.at(y);
  return sum;
}

template <class Real>
void Link<Real>::set_weight(std::size_t x, std::size_t y, Real weight) {
  MIMESIS_ASSERT(x < targets_ && y < sources_ && !low_rank_);
  weights_[y * targets_ + x] = weight;
  spans_[y] = {std::min(spans_[y].first, x), std::max(spans_[y].last, x + 1)};
}

template <class Real>
typename Link<Real>::Span Link<Real>::active_span(std::span<const Real> rate, Real above) {
  Span active{rate.size(), 0};
  for (std::size_t x = 0; x < rate.size(); ++x) {
    if (rate[x] < above) continue;
    active.first = std::min(active.first, x);
    active.last = x + 1;
  }
  return active;
}

template <class Real>
void Link<Real>::widen(std::size_t y, Span by) {
  spans_[y] = {std::min(spans_[y].first, by.first), std::max(spans_[y].last, by.last)};
}

template class Link<float>;
template class Link<double>;

}  // namespace mimesis::cognition
