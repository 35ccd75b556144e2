#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace mimesis::cognition {

/// Synapses A(x, y) from the neurons y of one field to the neurons x of another [M18 fig. 2.5]:
///
///   input:     S(x) = ∫ A(x, y) f₂(u(y)) dy                                    [M18 below eq. 2.5]
///   learning:  τ_s ȧ(x, y) = r (−a(x, y) + η f₂(ū₁(x)) f₂(ū₂(y))),  r = reward   [M18 eq. 2.3]
///   its limit: A(x, y) = η f₂(ū₁(x)) f₂(ū₂(y))                                 [M18 eq. 2.4]
///
/// Both rules act between the active populations only, u > local_above: the text requires that a
/// pattern leaves the synapses of the other patterns as they are, while eq. 2.3 alone would let
/// them decay. The weights are dense; rows outside the learned span of a column are exact zeros and
/// are skipped, which changes no bit of the result. Nothing allocates after construction.
template <class Real>
class Link {
 public:
  /// @param targets, sources neurons of the two fields
  /// @param dy distance of neighbours in the source field [1]
  Link(std::size_t targets, std::size_t sources, double dy);

  /// Adds S to `input` (size targets). O(learned weights).
  void transmit(std::span<const Real> source_rate, std::span<Real> input) const;

  /// One Euler step of eq. 2.3. A rate below `local_above_rate` = f₂(local_above) belongs to no
  /// active population; its synapses keep every bit.
  /// @param fraction r·dt/τ_s in [0, 1]; 0 (no reward) changes nothing
  void learn(std::span<const Real> target_rate, std::span<const Real> source_rate, Real eta,
             Real fraction, Real local_above_rate);

  /// Adds eq. 2.4 for one pair of patterns; rates below `local_above_rate` as in learn().
  void install(std::span<const Real> target_rate, std::span<const Real> source_rate, Real eta,
               Real local_above_rate);

  Real weight(std::size_t x, std::size_t y) const { return weights_[y * targets_ + x]; }
  void clear();

 private:
  struct Span {
    std::size_t first, last;  // rows [first, last) may differ from zero
  };
  void widen(std::span<const Real> target_rate, std::size_t y, Real local_above_rate);

  std::size_t targets_, sources_;
  Real dy_;
  std::vector<Real> weights_;  // column y holds A(·, y)
  std::vector<Span> spans_;    // per column
};

extern template class Link<float>;
extern template class Link<double>;

}  // namespace mimesis::cognition
