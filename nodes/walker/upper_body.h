#pragma once
#include <span>
#include <vector>

#include "nodes/walker/filter/dynamic_filter.h"

namespace mimesis::walker {

struct UpperBodySettings {
  double gain_1_s = 20.0;             ///< k, gain of the distance to the wish
  double speed_share = 0.9;           ///< used share of the joints' speed limits [1]
  double acceleration_rad_s2 = 40.0;  ///< largest acceleration of a joint
  double margin_rad = 0.01;           ///< kept from the joints' limits
};

/// Follows a wished posture of the upper body within limits of position, speed and acceleration:
/// q̇ = rate + k (wish − q), never faster than it can brake before the wish. A wish that stays
/// within the limits and begins at the present posture is followed without lag.
class UpperBodyFollower {
 public:
  UpperBodyFollower(const robot::Biped& biped, const UpperBodySettings& settings);

  void reset();  ///< half-sitting, at rest
  /// Sets the wish [rad], [rad/s] in the order of Biped::upper_body; empty: half-sitting. A wish of
  /// another size or with values that are not finite is refused; the last good one stays, at rest.
  /// No allocation.
  /// @return false if it was refused
  bool wish(const Eigen::VectorXd& q, const Eigen::VectorXd& rate);
  void step();

  const UpperBody& now() const { return now_; }
  bool clipped() const { return clipped_; }  ///< the wish is beyond the limits
  /// Prediction for `samples` (at most 64) instants, `dt_s` apart, beginning now. The wish is
  /// unknown, so the motion is assumed to continue and come to rest within about `settle_s`.
  std::span<const UpperBody> ahead(int samples, double dt_s, double settle_s);

 private:
  UpperBodySettings settings_;
  Eigen::VectorXd half_sitting_, lower_, upper_, speed_;
  Eigen::VectorXd wish_, rate_;
  UpperBody now_;
  std::vector<UpperBody> ahead_;
  bool clipped_ = false;
};

}  // namespace mimesis::walker
