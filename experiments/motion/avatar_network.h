#pragma once
#include <Eigen/Core>
#include <vector>

#include "nodes/synthesizer/dynamics/oscillator_network.h"
#include "nodes/synthesizer/dynamics/source_map.h"
#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

/// An avatar of [M18 fig. 3.16]: one Van der Pol oscillator per source, coupled with each other;
/// each row's value comes from the states, ξᵣ = mᵣ + Σₖ wᵣₖ fₖ(M(φᵣₖ) uₖ). Any mixture: with delays
/// (anechoic) or without (principal components).
class AvatarNetwork {
 public:
  /// @param maps  of the model's sources (learn_source_maps), which costs more than all the rest
  /// @param internal_1_s  strength of the velocity couplings within the avatar, everybody with
  ///                      everybody [M18 eq. 3.13]
  /// @param phase_rad     all oscillators start there
  AvatarNetwork(const Pattern& pattern, const std::vector<SourceMap>& maps, double internal_1_s,
                double phase_rad, double dt_s);

  /// Couples oscillator 0 to the leader's oscillator 0 ("Osc1" of fig. 3.16).
  void follow(const AvatarNetwork& leader, double strength_1_s);
  void step();

  int size() const { return network_.size(); }
  double phase(int k) const { return network_.phase(k); }
  Eigen::VectorXd angles() const;  ///< R [rad]
  /// The posture if all oscillators were at this phase of the limit cycle.
  Eigen::VectorXd angles_at(double phase_rad) const;

 private:
  Eigen::VectorXd mix(const Eigen::Matrix2Xd& circle) const;

  Pattern pattern_;
  Eigen::MatrixXd cos_, sin_;  ///< of the delays, R×K
  OscillatorNetwork<VanDerPol> network_;
  std::vector<SourceMap> maps_;
};

}  // namespace mimesis::synthesizer
