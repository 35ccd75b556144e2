#pragma once
#include <vector>

#include "nodes/synthesizer/dynamics/posture.h"

namespace mimesis::synthesizer {

/// How the pelvis travels over a cycle of a pattern, and when its feet stand: rows that depend on
/// the phase as its joint angles do, and blend as they do. The heading frame H: posture.h.
enum RootRow {
  kRootForward,  ///< travel along the heading, per phase [m/rad]
  kRootLeft,     ///< [m/rad]
  kRootTurn,     ///< of the heading, per phase [1]
  kRootHeight,   ///< of the pelvis above the ground [m]
  /// Phase to the nearest change of the left foot's contact, at most 0.5, after a contact 0.7 of
  /// it: > 0 while it stands [rad]
  kRootLeftStands,
  kRootRightStands,
  kRootWalks,  ///< 1; 0 of a pattern that does not move, whose feet stand [1]
  /// Displacement with which the left foot lands so that, standing, it is displaced by 0 on average
  kRootLeftLead,                       ///< forward, left [m]
  kRootRightLead = kRootLeftLead + 2,  ///< [m]
  kRootRows = kRootRightLead + 2
};
inline constexpr int kRootStride = 16;  ///< floats of a phase

/// Learns them from the postures of a cycle [M18 3.5]: the pelvis moves and turns so that standing
/// feet rest, and is as high as they carry it. Travel, turn and height are Fourier series of
/// kTravelHarmonics, fitted by least squares to what each foot that stands says: so the pelvis has
/// no jump where the feet change. The height keeps what both legs can reach. A foot stands where it
/// is low and, by the travel that results, slow; found in turns.
///
/// @param angle_rad  body rows of S phases, one after the other (kBodyRows values each)
/// @param duration_s  of the cycle
/// @return S rows of kRootStride
std::vector<float> learn_root(const BodyLanes& body, std::span<const float> angle_rad,
                              double duration_s);

}  // namespace mimesis::synthesizer
