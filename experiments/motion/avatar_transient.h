#pragma once
#include <Eigen/Core>
#include <vector>

#include "experiments/motion/avatar_network.h"
#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// A figure that walks one pattern, and the maps and the cycle that belong to it.
struct Avatar {
  /// Learns the maps: to 1 % of a source's rms, for recorded cycles do not close to better.
  /// @param model  of which pattern 0 is taken; it must have a row "lhip.y"
  explicit Avatar(const MotionModel& model);
  AvatarNetwork network(double internal_1_s, double phase_rad) const;

  MotionModel model;
  std::vector<SourceMap> maps;
  double drift_rad_s = 0.0;   ///< its gait turns by so much, as the recorded one did
  Eigen::MatrixXd cycle_rad;  ///< what it does left alone, R×(steps of a cycle)
};

/// How a follower comes into step with its leader.
struct TransientSettings {
  double internal_1_s = 1.0;  ///< within each avatar, the leader too; see AvatarNetwork
  double external_1_s = 1.0;  ///< of the leader's oscillator 0 on the follower's
  double offset_rad = 2.0;    ///< the follower's phases at the start; the leader's are 0
  double duration_s = 20.0;
  bool poses = false;  ///< keep them, of both
};

/// One instant, every kSample_s.
struct TransientInstant {
  double time_s;
  std::vector<double> phase_rad;  ///< of the follower's oscillators relative to the leader's first
  double artifact;                ///< see Transient
  Eigen::Vector2d position_W_m;
  double heading_rad;  ///< from the start, without the steady drift of its gait
};

struct Transient {
  static constexpr double kSample_s = 1.0 / 30.0;
  std::vector<TransientInstant> instants;
  std::vector<mocap::BodyPose> follower, leader;
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
