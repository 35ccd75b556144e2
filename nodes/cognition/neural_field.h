#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace mimesis::cognition {

/// Constants of one field [M18 eq. 2.1, 2.2]. Activity u, h and S are dimensionless; x is a
/// position on the feature axis of the layer, in units of its own [1].
struct FieldParams {
  int neurons = 128;            ///< N, along x
  int rows = 1;                 ///< along y; more than 1: a 2-D field
  double dx = 1.0;              ///< distance of neighbours on each axis [1]
  double tau_s = 0.020;         ///< time scale τ [s]
  double resting_level = -3.0;  ///< h < 0
  double slope = 2.0;           ///< β₁ = β₂
  double threshold1 = 0.1;      ///< θ₁, of the gate of the lateral interaction; θ₁ > θ₂
  double threshold2 = 0.0;      ///< θ₂, of the firing rate
  double excitation = 2.4;      ///< A_s, peak of the kernel w
  double width = 5.0;           ///< σ_s of w [1]
  double inhibition = 1.0;      ///< w_inhib; acts on the integral of f₂, not on its mean
};

/// One layer of neurons on 0 <= x < N·dx with open ends, integrated by Euler's method:
///
///   τ u̇(x) = −u(x) + h + S(x) + f₁(u(x)) [ ∫ w(x−x′) f₂(u(x′)) dx′ − w_inhib ∫ f₂(u(x′)) dx′ ]
///   fᵢ(u) = 1 / (1 + exp(−βᵢ (u − θᵢ))),   w(d) = A_s exp(−d² / 2σ_s²), cut off at 4 σ_s
///
/// [M18 eq. 2.1, 2.2 as printed]. In a 2-D field x is a place in the plane, and neuron (x, y) has
/// the index y·N + x; the kernel is the product of one along each axis. All arithmetic is in a
/// fixed order: the same inputs give the same bits. Real: float or double. step() costs O(neurons ·
/// 8σ_s/dx) for each axis, and does not allocate.
template <class Real>
class NeuralField {
 public:
  /// @param dt_s Euler step [s], 0 < dt <= τ (beyond, the linear part would overshoot).
  /// @throws ConfigError if a constant is out of its range.
  NeuralField(const FieldParams& params, double dt_s);

  /// External input S of the next step; inputs are added to it, step() clears it.
  std::span<Real> input() { return {input_.data(), size_}; }
  /// Advances u by dt with the input collected since the last step.
  void step();
  /// Back to rest: u = h, no input.
  void reset();

  std::span<const Real> activity() const { return {u_.data(), size_}; }  ///< u
  std::span<const Real> rate() const { return {rate_.data(), size_}; }   ///< f₂(u)
  /// max |u̇| in the last step [1/s].
  double speed_1_s() const;
  double f2(double u) const;  ///< firing rate of one activity
  const FieldParams& params() const { return params_; }

 private:
  void fire();
  void interact();

  FieldParams params_;
  std::size_t size_;            // all neurons
  std::size_t columns_, rows_;  // N rounded up to whole blocks
  std::size_t padded_, halo_;   // columns_·rows_; half width of the kernel
  Real relaxation_, beta_, shift1_, shift2_;
  std::vector<Real> kernel_;            // w(d)·dx, d = −halo .. halo
  std::vector<Real> kernel_y_;          // 2-D: the same without A_s
  std::vector<Real> u_, input_, gate_;  // u, S, f₁(u); padded_ long
  std::vector<Real> rate_;              // f₂(u)
  std::vector<Real> lateral_;           // bracket of eq. 2.1
  std::vector<Real> row_;               // one row of f₂(u) with zeros on both sides
  std::vector<Real> along_x_;           // 2-D: sums along x, with rows of zeros on both sides
  std::vector<Real> rise_;              // u(t) − u(t − dt)
  double dt_s_;
};

extern template class NeuralField<float>;
extern template class NeuralField<double>;

/// Synapses A(x, y) from the neurons y of one field to the neurons x of another [M18 fig. 2.5]:
///
///   input:     S(x) = ∫ A(x, y) f₂(u(y)) dy                                    [M18 below eq. 2.5]
///   learning:  τ_s ȧ(x, y) = r (−a(x, y) + η f₂(ū₁(x)) f₂(ū₂(y))),  r = reward   [M18 eq. 2.3]
///   its limit: A(x, y) = η f₂(ū₁(x)) f₂(ū₂(y))                                 [M18 eq. 2.4]
///
/// Both rules act between the active populations only, u > local_above: the text requires that a
/// pattern leaves the synapses of the other patterns as they are, while eq. 2.3 alone would let
/// them decay. Dense weights: rows outside the learned span of a column are exact zeros and
/// are skipped, which changes no bit of the result. Low rank: the pairs of eq. 2.4 as they are, so
/// that transmit() costs two sums for each; such a link cannot learn. No allocation after
/// construction, but in install() of low rank.
template <class Real>
class Link {
 public:
  /// f₂(local_above) of the two fields: a lower rate belongs to no active population.
  struct Above {
    Real target, source;
  };

  /// @param targets, sources neurons of the two fields
  /// @param dy distance (2-D: area) of neighbours in the source field [1]
  Link(std::size_t targets, std::size_t sources, double dy, bool low_rank = false);

  /// Adds S to `input` (size targets). O(learned weights).
  void transmit(std::span<const Real> source_rate, std::span<Real> input) const;

  /// What transmit() adds to one neuron.
  double input_at(std::span<const Real> source_rate, std::size_t x) const;

  /// One Euler step of eq. 2.3. Synapses of rates that are not `above` keep every bit. Dense only.
  /// @param fraction r·dt/τ_s in [0, 1]; 0 (no reward) changes nothing
  void learn(std::span<const Real> target_rate, std::span<const Real> source_rate, Real eta,
             Real fraction, Above above);

  /// Adds eq. 2.4 for one pair of patterns, between rates that are `above`.
  void install(std::span<const Real> target_rate, std::span<const Real> source_rate, Real eta,
               Above above);

  Real weight(std::size_t x, std::size_t y) const;
  void set_weight(std::size_t x, std::size_t y, Real weight);
  void clear();

 private:
  struct Span {
    std::size_t first, last;  // rows [first, last) may differ from zero
  };
  struct Pattern {  // without the zeros around it
    std::size_t first = 0;
    std::vector<Real> rate;
    Pattern(std::span<const Real> whole, Real factor, Real above);
    Real at(std::size_t i) const {
      return i >= first && i < first + rate.size() ? rate[i - first] : Real(0);
    }
  };
  struct Pair {  // the factors of eq. 2.4, η in the first
    Pattern target, source;
  };
  void widen(std::span<const Real> target_rate, std::size_t y, Real above);

  std::size_t targets_, sources_;
  Real dy_;
  bool low_rank_;
  std::vector<Pair> pairs_;    // low rank
  std::vector<Real> weights_;  // dense: column y holds A(·, y)
  std::vector<Span> spans_;    // per column
};

extern template class Link<float>;
extern template class Link<double>;

}  // namespace mimesis::cognition
