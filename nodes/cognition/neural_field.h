#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace mimesis::cognition {

/// Constants of one field [M18 eq. 2.1, 2.2]. Activity u, h and S are dimensionless; x is a
/// position on the feature axis of the layer, in units of its own [1].
struct FieldParams {
  int neurons = 128;            ///< N
  double dx = 1.0;              ///< distance of neighbours on the axis [1]
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
/// [M18 eq. 2.1, 2.2 as printed]. All arithmetic is in a fixed order: the same inputs give the same
/// bits. Real: float or double. step() costs O(N · 8σ_s/dx), and does not allocate.
template <class Real>
class NeuralField {
 public:
  /// @param dt_s Euler step [s], 0 < dt <= τ (beyond, the linear part would overshoot).
  /// @throws ConfigError if a constant is out of its range.
  NeuralField(const FieldParams& params, double dt_s);

  /// External input S of the next step; whoever drives the field adds to it, step() clears it.
  std::span<Real> input() { return {input_.data(), size_}; }
  /// Advances u by dt with the input collected since the last step.
  void step();
  /// Back to rest: u = h, no input.
  void reset();

  std::span<const Real> activity() const { return {u_.data(), size_}; }         ///< u
  std::span<const Real> rate() const { return {rate_.data() + halo_, size_}; }  ///< f₂(u)
  /// max |u̇| in the last step [1/s].
  double speed_1_s() const;
  double f2(double u) const;  ///< firing rate of one activity
  const FieldParams& params() const { return params_; }

 private:
  void fire();
  void interact();

  FieldParams params_;
  std::size_t size_, padded_, halo_;  // N; N rounded up to whole blocks; half width of the kernel
  Real relaxation_, beta_, shift1_, shift2_;
  std::vector<Real> kernel_;            // w(d)·dx, d = −halo .. halo
  std::vector<Real> u_, input_, gate_;  // u, S, f₁(u); padded_ long
  std::vector<Real> lateral_;           // bracket of eq. 2.1
  std::vector<Real> rate_;              // f₂(u) with zeros on both sides
  std::vector<Real> rise_;              // u(t) − u(t − dt)
  double dt_s_;
};

extern template class NeuralField<float>;
extern template class NeuralField<double>;

}  // namespace mimesis::cognition
