#pragma once
#include "common/motion/mocap/body.h"

namespace mimesis::mocap {

/// A made-up walker: straight legs that swing as sines about the hips, the left ahead at phase 0,
/// the feet kept level. Its farthest heel positions are known in closed form.
struct Walker {
  double rate_hz = 120.0, period_s = 1.1, seconds = 5.0;
  double swing_rad = 0.4;    ///< amplitude of the thigh, to either side
  double speed_m_s = 1.2;    ///< along the heading; negative: backwards
  double turn_rad_s = 0.0;   ///< turning rate of the heading, + to the left
  double heading_rad = 0.0;  ///< at the start
  double start_phase_rad = 1.0;
};
BodyClip walk(const Walker& walker);

}  // namespace mimesis::mocap
