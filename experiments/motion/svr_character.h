#pragma once
#include <Eigen/Core>
#include <vector>

#include "experiments/motion/oscillator_network.h"
#include "experiments/motion/source_map.h"

namespace mimesis::synthesizer {

/// The architecture of [M18 fig. 3.19] as it is drawn, without shortcuts: a leading oscillator (0),
/// one oscillator per periodic source coupled to it, and each row's value from the states:
///   ξᵣ = mᵣ + Σₖ wᵣₖ fₖ(M(φᵣₖ) xₖ),
/// one evaluation of a learned map for every row and source; fixed sources take the leader's phase.
/// It shows the sources while their oscillators are not synchronized, and is the yardstick for
/// CharacterBatch, which computes the same a few hundred times faster in the synchronized state.
class SvrCharacter {
 public:
  /// @param coupling_1_s  strength of the star, > 0;  @throws ConfigError as its parts do.
  SvrCharacter(const motion::MotionModel& model, double coupling_1_s, double dt_s,
               const SvrSettings& settings = {});

  void set_pattern(const motion::Pattern& pattern);  ///< sizes as in the model
  void set_frequency(double omega_rad_s);            ///< sets the frequency of all oscillators
  void step();                                       ///< by dt; does not allocate

  const Eigen::VectorXd& angles() const { return angles_; }  ///< R [rad]
  const std::vector<SourceMap>& maps() const { return maps_; }
  /// Leader 0, then the periodic sources in the model's order.
  OscillatorNetwork<AndronovHopf>& network() { return network_; }

 private:
  void synthesize();

  int fixed_;
  OscillatorNetwork<AndronovHopf> network_;
  std::vector<SourceMap> maps_;
  motion::Pattern pattern_;
  Eigen::VectorXd angles_;
};

}  // namespace mimesis::synthesizer
