#pragma once
#include <array>
#include <span>
#include <vector>

#include "nodes/cognition/neural_field.h"
#include "nodes/cognition/symbols.h"

namespace mimesis::cognition {

/// Peak inputs that one self-sustained pattern gives to its partner through a link [1]. Above the
/// threshold of ignition (2.2 for a field at rest) a link drives the next field, below it only
/// preshapes it.
struct LinkGains {
  double sts_to_pf = 1.3;  ///< grip and transport each; only both together ignite PF
  double sts_to_f5 = 1.0;  ///< direct matching, preshapes
  double pf_to_f5 = 4.5;   ///< an ignited combination ignites its means
  double pf_to_pfc = 1.9;  ///< from PF to PFC, learned
  double pfc_to_pf = 2.6;  ///< from PFC to PF, learned
  double f5_to_pf = 0.9;   ///< F5g and F5t each: a planned motion names its combination
  double color = 4.5;      ///< gain: COL to PFC and back, learned; vision: to COL

  template <class V>
  void visit(V& v) {
    v("sts_to_pf", sts_to_pf, 0.0, 20.0);
    v("sts_to_f5", sts_to_f5, 0.0, 20.0);
    v("pf_to_f5", pf_to_f5, 0.0, 20.0);
    v("pf_to_pfc", pf_to_pfc, 0.0, 20.0);
    v("pfc_to_pf", pfc_to_pf, 0.0, 20.0);
    v("f5_to_pf", f5_to_pf, 0.0, 20.0);
    v("color", color, 0.0, 20.0);
  }
};

/// Gaussian inputs from vision at full confidence: amplitudes [1], width [1], duration [s].
struct VisionInput {
  double sts = 6.0;   ///< amplitude to STSg and STSt, each
  double pfc = 3.45;  ///< amplitude to PFC
  double color = 4.5;
  double width = 5.0;     ///< σ on the feature axis [1]; vision: of the task input too
  double window_s = 0.6;  ///< vision: input of a demonstration; learning: reward of a success

  template <class V>
  void visit(V& v) {
    v("sts", sts, 0.0, 20.0);
    v("pfc", pfc, 0.0, 20.0);
    v("color", color, 0.0, 20.0);
    v("width", width, 0.5, 50.0);
    v("window_s", window_s, 0.01, 10.0);
  }
};

/// Knowledge of a familiar task: constant input that preshapes [M18 2.2.2], amplitudes
/// [1].
struct TaskInput {
  double pf = 1.2;    ///< amplitude to PG-AT and FG-BT
  double pfc = 1.42;  ///< amplitude to both goals

  template <class V>
  void visit(V& v) {
    v("pf", pf, 0.0, 20.0);
    v("pfc", pfc, 0.0, 20.0);
  }
};

/// Learning by eq. 2.3.
struct Learning {
  double tau_s = 0.4;     ///< learning: τ_s, much longer than τ; field: τ [s]
  double window_s = 2.0;  ///< duration of the reward of a success [s]
  /// Activity that makes a neuron part of a population: u_TH. Below it, what is merely preshaped
  /// would be linked as if it had been decided [1].
  double local_above = 0.0;

  template <class V>
  void visit(V& v) {
    v("tau_s", tau_s, 0.01, 100.0);
    v("window_s", window_s, 0.01, 100.0);
    v("local_above", local_above, -10.0, 10.0);
  }
};

/// All constants of the ladder. The values are one set that shows every figure of M18 2.4; M18
/// prints none.
struct LadderParams {
  double dt_s = 0.001;       ///< Euler step; 1, 2 and 5 ms give the same decisions
  double sts_tau_s = 0.086;  ///< τ of the two STS fields
  double pf_tau_s = 0.011;   ///< τ of PF
  double pfc_tau_s = 0.06;   ///< τ of PFC; all others: field.tau_s
  double plan = 3.5;         ///< input of a successful test plan to F5g and F5t, each [1]
  FieldParams field{};
  LinkGains gain{};
  VisionInput vision{};
  TaskInput task{};
  Learning learning{};

  template <class V>
  void visit(V& v) {
    v("dt_s", dt_s, 1e-4, 0.005);
    v("sts_tau_s", sts_tau_s, 0.005, 1.0);
    v("pf_tau_s", pf_tau_s, 0.005, 1.0);
    v("pfc_tau_s", pfc_tau_s, 0.005, 1.0);
    v("plan", plan, 0.0, 20.0);
    v.group("field", [&](auto& g) {
      g("neurons", field.neurons, 32, 1024);
      g("dx", field.dx, 0.05, 10.0);
      g("tau_s", field.tau_s, 0.005, 1.0);
      g("resting_level", field.resting_level, -20.0, -0.01);
      g("slope", field.slope, 0.1, 20.0);
      g("threshold1", field.threshold1, -5.0, 5.0);
      g("threshold2", field.threshold2, -5.0, 5.0);
      g("excitation", field.excitation, 0.0, 50.0);
      g("width", field.width, 0.5, 50.0);
      g("inhibition", field.inhibition, 1e-3, 50.0);
    });
    v.group("gain", [&](auto& g) { gain.visit(g); });
    v.group("vision", [&](auto& g) { vision.visit(g); });
    v.group("task", [&](auto& g) { task.visit(g); });
    v.group("learning", [&](auto& g) { learning.visit(g); });
  }
};

/// Links of the ladder, source first.
enum class Connection {
  sts_grip_pf,
  sts_transport_pf,
  sts_grip_f5,
  sts_transport_f5,
  pf_f5_grip,
  pf_f5_transport,
  f5_grip_pf,
  f5_transport_pf,
  pf_pfc,
  pfc_pf,
  color_pfc,
  pfc_color,
};
inline constexpr std::size_t kConnections = 12;

/// Amplitudes of the Gaussian inputs, per layer and site [1].
class Stimulus {
 public:
  double& at(Layer layer, int site) {
    return amplitude_[index(layer)][static_cast<std::size_t>(site)];
  }
  double at(Layer layer, int site) const {
    return amplitude_[index(layer)][static_cast<std::size_t>(site)];
  }

 private:
  std::array<std::array<double, 4>, kLayers> amplitude_{};
};

/// Task input [M18 2.2.2]: preshapes both familiar sequences and both goals.
Stimulus task_stimulus(const TaskInput& task);
/// Adds what vision saw; unknown symbols add nothing.
void add_vision(const VisionInput& vision, const Demonstration& shown, Stimulus& to);
/// Adds `amplitude` to the means of a test plan in F5 [M18 2.4.3, fig. 2.22].
void add_plan(double amplitude, const Demonstration& planned, Stimulus& to);

/// Seven coupled fields that match observations with the robot's actions and goals [M18 fig. 2.2]:
///
///   STSg ──┬──> F5g <─┐         COL      STS->PF, STS->F5, PF<->F5: innate (eq. 2.4)
///          └──> PF <──┼──<──> PFC <─┘    PF<->PFC, COL<->PFC: learned (eq. 2.3)
///   STSt ──┬──> PF    │
///          └──> F5t <─┘
///
/// A step is O(7 N · 8σ/dx + learned weights); it does not allocate, and the same inputs give the
/// same bits.
template <class Real>
class Ladder {
 public:
  /// @throws ConfigError if the constants are out of range, or do not allow a self-sustained
  /// pattern.
  explicit Ladder(const LadderParams& params);

  /// Advances all fields by dt; with `reward` the learned links follow eq. 2.3.
  void step(const Stimulus& stimulus, bool reward = false);
  /// Activity back to rest. Links stay.
  void reset();

  const NeuralField<Real>& field(Layer layer) const { return fields_[index(layer)]; }
  const Link<Real>& link(Connection c) const { return links_[static_cast<std::size_t>(c)]; }
  const LadderParams& params() const { return params_; }

  /// Adds `factor` times the link that a full reward window would leave between two patterns
  /// [eq. 2.4].
  void install(Connection c, int source_site, int target_site, double factor = 1.0);
  /// A lesion: the link transmits nothing until it is learned again.
  void cut(Connection c) { links_[static_cast<std::size_t>(c)].clear(); }
  /// One synapse as it was learned before.
  void set_weight(Connection c, std::size_t target, std::size_t source, Real weight) {
    links_[static_cast<std::size_t>(c)].set_weight(target, source, weight);
  }
  /// η of eq. 2.3 for one link.
  double eta(Connection c) const { return eta_[static_cast<std::size_t>(c)]; }

 private:
  void settle_patterns();
  void install_innate();
  std::span<const Real> pattern(Layer layer, int site) const {
    return patterns_[index(layer)][static_cast<std::size_t>(site)];
  }
  void learn(Connection c, Real fraction);

  LadderParams params_;
  std::vector<NeuralField<Real>> fields_;
  std::vector<Link<Real>> links_;
  std::array<double, kConnections> eta_{};
  Real local_above_rate_;
  std::array<std::array<std::vector<Real>, 4>, kLayers> bump_;  // unit Gaussians of the inputs
  std::array<std::array<std::vector<Real>, 4>, kLayers>
      patterns_;  // f₂(ū) of a self-sustained pattern
};

extern template class Ladder<float>;
extern template class Ladder<double>;

}  // namespace mimesis::cognition
