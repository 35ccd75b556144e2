#pragma once
#include <vector>

#include "nodes/synthesizer/drawer/limb_ik.h"

namespace mimesis::synthesizer {

/// One stand of a foot on the ground: heel first, then the whole sole, then the toes.
struct Footprint {
  double x_m = 0.0, y_m = 0.0;    ///< of the ankle while the sole is flat, W
  double strike_s = 0.0;          ///< the heel touches
  double flat_s = 0.0;            ///< the sole is down
  double heel_off_s = 0.0;        ///< the heel leaves; infinity if the foot stays
  double lift_s = 0.0;            ///< the toes leave; infinity if the foot stays
  double strike_pitch_rad = 0.0;  ///< < 0: toes up
  double lift_pitch_rad = 0.0;    ///< > 0: heel up
};

enum class Contact { kSwing, kHeel, kFlat, kToe };

struct FootState {
  FootPose pose;
  Contact contact = Contact::kSwing;
};

/// The way of one foot over its footprints. What touches the ground neither slides nor sinks: the
/// foot rolls about the heel point, then about the toe point; between, a cubic with the velocities
/// of both ends and a clearance of `clearance_m` added in the middle.
class FootPath {
 public:
  /// Footprints in order of time, at least one. `body` gives heel, toe and the sole's height.
  FootPath(const mocap::Body& body, mocap::Side side, std::vector<Footprint> prints,
           double clearance_m, double yaw_rad);
  /// At time t [s], which must not be before the first strike.
  FootState at(double t) const;

 private:
  FootState standing(const Footprint& print, double t) const;
  FootPose rolled(const Footprint& print, const Eigen::Vector3d& pivot, double pitch_rad) const;

  std::vector<Footprint> prints_;
  Eigen::Vector3d heel_, toe_;
  double clearance_m_, yaw_rad_;
};

}  // namespace mimesis::synthesizer
