#pragma once
#include <string>
#include <vector>

#include "common/motion/model/motion_model.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::tool {

/// The speed function g and the sway g^psi of one style of a motion model.
struct MeasuredGait {
  crowd::Gait gait;
  double step_length_m = 0.0;
  double rms_m_rad = 0.0;                      ///< error of the harmonics
  double least_m_rad = 0.0, most_m_rad = 0.0;  ///< range of the series
};

/// Walks straight with each style for some cycles and takes the Fourier series of the pelvis'
/// propagation along its heading, and of its turning, per radian of phase: ż/φ̇, ψ̇/φ̇ [M18 4.4.1,
/// fig. 4.9a, eq. 4.32].
/// @param style      "": all that walk on, by a tenth of a metre a step at least
/// @param harmonics  [0, 4]
/// @throws ConfigError for an unknown style, and where g touches zero
std::vector<MeasuredGait> measure_gaits(const motion::MotionModel& model, const std::string& style,
                                        int harmonics);

}  // namespace mimesis::tool
