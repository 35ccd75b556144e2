#pragma once
#include <span>
#include <vector>

namespace mimesis::cognition {

/// Constants of a field of two populations [M18 eq. 2.6, 2.7]: u excites, v inhibits. Units as in
/// FieldParams.
struct TransientParams {
  int neurons = 64;             ///< N of each population
  double dx = 1.0;              ///< distance of neighbours on the axis [1]
  double tau_u_s = 0.020;       ///< τ_u [s]
  double tau_v_s = 0.150;       ///< τ_v [s]
  double resting_level = -2.0;  ///< h < 0
  double slope = 2.0;           ///< of f and of g for u; both have the threshold 0
  double slope_v = 1.0;         ///< of g for v
  double threshold_v = 1.0;     ///< of g for v
  double excitation = 1.3;      ///< A_u, peak of w^u
  double width_u = 3.0;         ///< σ_u of w^u [1], below σ_v
  double inhibition = 0.6;      ///< A_v, peak of w^v
  double width_v = 8.0;         ///< σ_v of w^v [1]
};

/// A field whose answer to an input is transient: inhibition follows excitation, and ends it.
///
///   τ_u u̇ᵢ = −uᵢ + h + Sᵢ + g(uᵢ) [ Σⱼ w^u(i−j) f(uⱼ) − vᵢ ]     [M18 eq. 2.6]
///   τ_v v̇ᵢ = −vᵢ + g_v(vᵢ) Σⱼ w^v(i−j) f(uⱼ)                     [M18 eq. 2.7 with f(uⱼ)]
///
/// f, g, g_v: sigmoids; w: Gaussians cut off at 4 σ. M18 prints f(vⱼ) in eq. 2.7: then nothing of u
/// reaches v, and a peak of u never ends. Euler's method in a fixed order: the same inputs give the
/// same bits. step() does not allocate.
class TransientField {
 public:
  /// @throws ConfigError if a constant is out of its range
  TransientField(const TransientParams& params, double dt_s);

  /// External input S of the next step; inputs are added to it, step() clears it.
  std::span<double> input() { return input_; }
  void step();
  void reset();  ///< u = h, v = 0

  std::span<const double> activity() const { return u_; }  ///< u
  std::span<const double> rate() const { return rate_; }   ///< f(u)
  const TransientParams& params() const { return params_; }

 private:
  TransientParams params_;
  double dt_s_;
  std::vector<double> kernel_u_, kernel_v_;  // w(d)·dx, d >= 0
  std::vector<double> u_, v_, input_, rate_;
};

/// Constants of the shunted rule [M18 eq. 2.8].
struct ShuntedParams {
  double tau_s = 0.2;      ///< τ_s, much longer than τ_u [s]
  double alpha = 1.0;      ///< α, weight of an established link [1]
  double beta = 0.002;     ///< β, passive decay, far below α [1]
  double threshold = 7.0;  ///< u_h of the shunting term, above that of f
  double slope = 4.0;      ///< of the shunting term
};

/// Synapses that learn with each activity of the postsynaptic neuron i, no reward needed:
///
///   τ_s ṡᵢⱼ = h(uᵢ) [ α f(uⱼ) f(uᵢ) − sᵢⱼ ] − β sᵢⱼ,   h: a sigmoid     [M18 eq. 2.8]
///
/// A highly active i gains links from what is active with it (active learning) and loses those from
/// what is silent (active forgetting): events that come together merge, others separate, and
/// after A then B only A->B stays.
class ShuntedLink {
 public:
  ShuntedLink(const ShuntedParams& params, double dt_s, std::size_t targets, std::size_t sources,
              double weight);

  double& weight(std::size_t target, std::size_t source) {
    return weights_[source * targets_ + target];
  }
  /// Adds gain · Σⱼ sᵢⱼ f(uⱼ) to `input`.
  void transmit(std::span<const double> source_rate, double gain, std::span<double> input) const;
  /// One Euler step of eq. 2.8.
  void learn(std::span<const double> target_activity, std::span<const double> target_rate,
             std::span<const double> source_rate);

 private:
  ShuntedParams params_;
  double dt_s_;
  std::size_t targets_;
  std::vector<double> weights_;  // column j holds s(·, j)
  std::vector<double> shunt_;    // h(uᵢ)
};

}  // namespace mimesis::cognition
