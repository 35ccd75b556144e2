#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace mimesis::cognition {

inline constexpr double kCutoff = 4.0;  ///< kernels end there [σ]

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
  /// The second population v of a transient field [M18 eq. 2.6, 2.7]: its inhibition follows the
  /// activity, and ends it. 0: there is none.
  double decay = 0.0;            ///< A_v, peak of w^v
  double decay_tau_s = 0.150;    ///< τ_v > τ [s]
  double decay_width = 8.0;      ///< σ_v of w^v, above σ_s [1]
  double decay_slope = 1.0;      ///< of g_v
  double decay_threshold = 1.0;  ///< of g_v
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
///
/// With `decay` the field is transient, of two populations:
///
///   τ u̇(x) = −u(x) + h + S(x) + f₁(u(x)) [ ∫ w f₂(u) − w_inhib ∫ f₂(u) − v(x) ]    [M18 eq. 2.6]
///   τ_v v̇(x) = −v(x) + g_v(v(x)) ∫ w^v(x−x′) f₂(u(x′)) dx′                         [M18 eq. 2.7]
///
/// M18 has w_inhib = 0 and θ₁ = θ₂ = 0 there, and prints f(v) in eq. 2.7: then nothing of u reaches
/// v, and a peak of u never ends.
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
  bool transient() const { return params_.decay > 0.0; }
  /// max |u̇| in the last step [1/s].
  double speed_1_s() const;
  double f2(double u) const;  ///< firing rate of one activity
  const FieldParams& params() const { return params_; }

 private:
  struct Kernel {
    std::vector<Real> x, y;  // w(d)·dx, d = −left .. right; 2-D: y is the same without A
    std::size_t left = 0;
  };
  Kernel kernel(double amplitude, double width) const;
  void fire();
  void interact();
  void sum_rates(const Kernel& w, Real less, Real* sums);
  void follow();

  FieldParams params_;
  std::size_t size_;            // all neurons
  std::size_t columns_, rows_;  // N rounded up to whole blocks
  std::size_t padded_, halo_;   // columns_·rows_; half width of the widest kernel
  Real relaxation_, beta_, shift1_, shift2_;
  Kernel excitation_, decay_;
  std::vector<Real> u_, input_, gate_;  // u, S, f₁(u); padded_ long
  std::vector<Real> rate_;              // f₂(u)
  std::vector<Real> lateral_;           // bracket of eq. 2.1
  std::vector<Real> row_;               // one row of f₂(u) with zeros on both sides
  std::vector<Real> along_x_;           // 2-D: sums along x, with rows of zeros on both sides
  std::vector<Real> rise_;              // u(t) − u(t − dt)
  std::vector<Real> v_, drive_;         // transient: v, and what drives it
  double dt_s_;
};

extern template class NeuralField<float>;
extern template class NeuralField<double>;

/// Constants of the shunted rule, which links populations that are active one after the other:
///
///   τ_s ȧ(x, y) = h(u(x)) [α f₂(u(x)) f₂(u(y)) − a(x, y)] − β a(x, y),  h: a sigmoid  [M18
///   eq. 2.8]
struct ShuntedParams {
  double tau_s = 0.2;      ///< τ_s, much longer than τ [s]
  double alpha = 1.0;      ///< α, weight of an established link [1]
  double beta = 0.002;     ///< β, passive decay, far below α [1]
  double threshold = 7.0;  ///< u_h of h, above θ₂
  double slope = 4.0;      ///< of h
};

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

  /// The input that transmit() adds to one neuron.
  double input_at(std::span<const Real> source_rate, std::size_t x) const;

  /// One Euler step of eq. 2.3. Synapses of rates that are not `above` keep every bit. Dense only.
  /// @param fraction r·dt/τ_s in [0, 1]; 0 (no reward) changes nothing
  void learn(std::span<const Real> target_rate, std::span<const Real> source_rate, Real eta,
             Real fraction, Above above);

  /// One Euler step of eq. 2.8. A highly active target gains links from what is active with it, and
  /// loses those from what is silent: events that come together merge, others separate, and after A
  /// then B only A->B stays. No reward is needed. Dense only.
  void learn_shunted(std::span<const Real> target_activity, std::span<const Real> target_rate,
                     std::span<const Real> source_rate, const ShuntedParams& rule, double dt_s);

  /// Adds eq. 2.4 for one pair of patterns, between rates that are `above`.
  void install(std::span<const Real> target_rate, std::span<const Real> source_rate, Real eta,
               Above above);

  Real weight(std::size_t x, std::size_t y) const;
  void set_weight(std::size_t x, std::size_t y, Real weight);
  void fill(Real weight);  ///< all; eq. 2.8 starts from little
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
  static Span active_span(std::span<const Real> rate, Real above);
  void widen(std::size_t y, Span by);

  std::size_t targets_, sources_;
  Real dy_;
  bool low_rank_;
  std::vector<Pair> pairs_;    // low rank
  std::vector<Real> weights_;  // dense: column y holds A(·, y)
  std::vector<Span> spans_;    // per column
  std::vector<Real> shunt_;    // h(u(x)), dense
};

extern template class Link<float>;
extern template class Link<double>;

}  // namespace mimesis::cognition
