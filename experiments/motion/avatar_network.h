#pragma once
#include <Eigen/Core>
#include <vector>

#include "common/motion/mocap/body.h"
#include "common/motion/model/motion_model.h"
#include "experiments/motion/oscillator_network.h"
#include "experiments/motion/source_map.h"

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
  AvatarNetwork(const motion::Pattern& pattern, const std::vector<SourceMap>& maps,
                double internal_1_s, double phase_rad, double dt_s);

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

  motion::Pattern pattern_;
  Eigen::MatrixXd cos_, sin_;  ///< cosine and sine of the delays, R×K
  OscillatorNetwork network_;
  std::vector<SourceMap> maps_;
};

/// A figure that walks one pattern, and the maps and the cycle that belong to it.
struct Avatar {
  /// Learns the maps: to 1 % of a source's rms, for recorded cycles do not close to better.
  /// @param model  of which pattern 0 is taken; it must have a row "lhip.y"
  explicit Avatar(const motion::MotionModel& model);
  AvatarNetwork network(double internal_1_s, double phase_rad) const;

  motion::MotionModel model;
  std::vector<SourceMap> maps;
  double drift_rad_s = 0.0;   ///< its gait turns at this rate, like the recorded one
  Eigen::MatrixXd cycle_rad;  ///< motion without coupling, R×(steps of a cycle)
};

/// How a follower comes into step with its leader.
struct TransientSettings {
  double internal_1_s = 1.0;  ///< within each avatar, the leader too; see AvatarNetwork
  double external_1_s = 1.0;  ///< coupling of the leader's oscillator 0 to the follower's
  double offset_rad = 2.0;    ///< the follower's phases at the start; the leader's are 0
  double duration_s = 20.0;
};

/// One instant, every kSample_s.
struct TransientInstant {
  double time_s;
  /// phases of the follower's oscillators relative to the leader's first
  std::vector<double> phase_rad;
  double artifact;  ///< see Transient
  Eigen::Vector2d position_W_m;
  double heading_rad;  ///< from the start, without the steady drift of its gait
};

struct Transient {
  static constexpr double kSample_s = 1.0 / 30.0;
  std::vector<TransientInstant> instants;
  /// Distance of the posture from the gait's own cycle: the least over φ of rms(ξ(t) − ξ_cycle(φ)),
  /// relative to the cycle's rms about its mean; largest of all instants. Zero if the avatar is
  /// only ahead or behind [1].
  double artifact = 0.0;
  /// Until all oscillators stay within 0.1 rad of the leader's first; duration if they do not.
  double synchronised_s = 0.0;
  /// Least flexion of the left hip from peak to peak within a cycle, relative to the steady one.
  double least_step = 1.0;
  double heading_rad = 0.0;  ///< largest change of heading, but for the steady drift
};

Transient come_into_step(const Avatar& leads, const Avatar& follows,
                         const TransientSettings& settings);

}  // namespace mimesis::synthesizer
