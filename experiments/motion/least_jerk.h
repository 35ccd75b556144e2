#pragma once
#include <vector>

#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/dynamics/motion_series.h"

namespace mimesis::synthesizer {

/// A transition beside that of [M18 eq. 3.23], over the same interval φ ∈ [−βπ, βπ]: each joint
/// angle goes along the polynomial of fifth degree in time that has the angle, velocity and
/// acceleration of the previous action where the interval begins and those of the next one where it
/// ends. Of all motions with these ends it has the least ∫jerk² (Flash and Hogan). The frequency
/// goes with α(φ), as in transition(); time follows from it.
///
/// Eq. 3.23 adds two motions that continue, and α''s jumps at both ends; this one goes over from
/// one to the other without following either, so that what both do within the interval is lost. It
/// is for actions that differ much, and it needs the sources.
class LeastJerkTransition {
 public:
  /// β in (0, 1]. @throws ConfigError for another β or a model that cannot be played
  /// (MotionSeries)
  LeastJerkTransition(const motion::MotionModel& model, double beta);

  /// Sizes as in the model; frequencies > 0. Some 100 µs for 51 rows; does not allocate.
  void prepare(const MotionParameters& previous, const MotionParameters& next);

  /// The parameters at a phase in [−βπ, βπ] after prepare(): the means are the joint angles, the
  /// weights are 0. Every player of parameters can play this. Does not allocate if `out` has the
  /// size.
  void at(double phase_rad, MotionParameters& out) const;

  double duration_s() const { return duration_s_; }  ///< duration of the interval

 private:
  double time_s(double phase_rad) const;  ///< since the beginning of the interval

  MotionSeries series_;
  std::vector<float> factors_;
  double beta_, before_rad_s_ = 0.0, after_rad_s_ = 0.0, duration_s_ = 0.0;
  Eigen::MatrixXd coefficient_;  ///< R×6, powers of the share of the duration
  Eigen::MatrixXd begin_, end_;  ///< R×3: angle and derivatives by phase
};

}  // namespace mimesis::synthesizer
