#include "nodes/cognition/link.h"

#include <algorithm>

#include "common/error.h"

namespace mimesis::cognition {

template <class Real>
Link<Real>::Link(std::size_t targets, std::size_t sources, double dy)
    : targets_(targets),
      sources_(sources),
      dy_(static_cast<Real>(dy)),
      weights_(targets * sources),
      spans_(sources) {
  clear();
}

template <class Real>
void Link<Real>::clear() {
  std::ranges::fill(weights_, Real(0));
  std::ranges::fill(spans_, Span{targets_, 0});
}

template <class Real>
void Link<Real>::transmit(std::span<const Real> source_rate, std::span<Real> input) const {
  Real* __restrict s = input.data();
  for (std::size_t y = 0; y < sources_; ++y) {
    const Real rate = source_rate[y] * dy_;
    const Real* __restrict column = weights_.data() + y * targets_;
    const auto [first, last] = spans_[y];
    for (std::size_t x = first; x < last; ++x) s[x] += column[x] * rate;
  }
}

template <class Real>
void Link<Real>::learn(std::span<const Real> target_rate, std::span<const Real> source_rate,
                       Real eta, Real fraction, Real local_above_rate) {
  MIMESIS_ASSERT(fraction >= 0 && fraction <= 1);
  if (fraction == 0) return;
  for (std::size_t y = 0; y < sources_; ++y) {
    if (source_rate[y] < local_above_rate) continue;
    widen(target_rate, y, local_above_rate);
    const auto [first, last] = spans_[y];
    Real* __restrict column = weights_.data() + y * targets_;
    const Real* __restrict target = target_rate.data();
    for (std::size_t x = first; x < last; ++x) {
      const Real change = fraction * (eta * target[x] * source_rate[y] - column[x]);
      column[x] += target[x] < local_above_rate ? Real(0) : change;
    }
  }
}

template <class Real>
void Link<Real>::install(std::span<const Real> target_rate, std::span<const Real> source_rate,
                         Real eta, Real local_above_rate) {
  for (std::size_t y = 0; y < sources_; ++y) {
    if (source_rate[y] < local_above_rate) continue;
    widen(target_rate, y, local_above_rate);
    for (std::size_t x = 0; x < targets_; ++x) {
      if (target_rate[x] < local_above_rate) continue;
      weights_[y * targets_ + x] += eta * target_rate[x] * source_rate[y];
    }
  }
}

template <class Real>
void Link<Real>::widen(std::span<const Real> target_rate, std::size_t y, Real local_above_rate) {
  Span& span = spans_[y];
  for (std::size_t x = 0; x < targets_; ++x) {
    if (target_rate[x] < local_above_rate) continue;
    span.first = std::min(span.first, x);
    span.last = std::max(span.last, x + 1);
  }
}

template class Link<float>;
template class Link<double>;

}  // namespace mimesis::cognition
