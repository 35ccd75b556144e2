#pragma once
#include <array>
#include <span>
#include <vector>

#include "nodes/cognition/ladder_params.h"
#include "nodes/cognition/link.h"
#include "nodes/cognition/neural_field.h"
#include "nodes/cognition/symbols.h"

namespace mimesis::cognition {

/// Links of the ladder, source first.
enum class Connection {
  sts_grip_pf,
  sts_transport_pf,
  sts_grip_f5,
  sts_transport_f5,
  pf_f5_grip,
  pf_f5_transport,
  pf_pfc,
  pfc_pf,
  color_pfc,
  pfc_color,
};
inline constexpr std::size_t kConnections = 10;

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

/// Seven coupled fields that match what is seen with what the robot can do and with its goals [M18
/// fig. 2.2]:
///
///   STSg ──┬──> F5g <──┐        COL          STS->PF, STS->F5, PF->F5: innate (eq. 2.4 at
///   construction)
///          └──> PF ────┼──<──> PFC <─┘       PF<->PFC, COL<->PFC: learned (eq. 2.3)
///   STSt ──┬──> PF     │
///          └──> F5t <──┘
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
