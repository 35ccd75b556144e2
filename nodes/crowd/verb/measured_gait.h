#pragma once
#include <string>
#include <vector>

#include "common/motion/model/motion_model.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

struct SpeedSample {
  double phase_rad, g_m_rad;  ///< ż/φ̇
  double turn;                ///< ψ̇/φ̇ [1]
};

/// The pelvis' way along its heading, and its turning, over four cycles of walks straight on.
/// @param steps  lengths of steps, shares of the style's, >= 0; other than 1 needs a model with
/// tied
///               delays
/// @throws ConfigError for an unknown style
std::vector<std::vector<SpeedSample>> walk_straight(const motion::MotionModel& model,
                                                    const std::string& style,
                                                    const std::vector<double>& steps);

/// The speed function g and the sway g^psi of one style of a motion model.
struct MeasuredGait {
  Gait gait;
  double step_length_m = 0.0;
  double rms_m_rad = 0.0;                      ///< of what the harmonics leave out
  double least_m_rad = 0.0, most_m_rad = 0.0;  ///< of the series
};

/// Walks straight with each style for some cycles and takes the Fourier series of the pelvis'
/// propagation along its heading, and of its turning, per radian of phase: ż/φ̇, ψ̇/φ̇ [M18 4.4.1,
/// fig. 4.9a, eq. 4.32].
/// @param style      "": all that walk on, by a tenth of a metre a step at least
/// @param harmonics  [0, 4]
/// @throws ConfigError for an unknown style, and where g touches zero
std::vector<MeasuredGait> measure_gaits(const motion::MotionModel& model, const std::string& style,
                                        int harmonics);

}  // namespace mimesis::crowd
