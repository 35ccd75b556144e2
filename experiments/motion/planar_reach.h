#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>

#include "experiments/harness/figure.h"
#include "nodes/synthesizer/control/planar_arm.h"

/// The reaches of the planar arm that fig. 3.22 shows and that style-preserving-reach learns from.
namespace mimesis::synthesizer {

inline constexpr int kReachSamples = 100;
inline constexpr double kReachStep_s = 0.01;

inline PlanarArm planar_arm() { return {Eigen::Vector3d(0.3, 0.25, 0.15)}; }
inline Eigen::Vector3d reach_start() { return {-0.25, 0.0, 1.5}; }

/// +1: elbow up (shoulder raised, elbow bent down again); −1: elbow down.
inline ArmStyle elbow_style(double side) {
  return {Eigen::Vector3d(0.9 * side, -1.5 * side, 0.0), Eigen::Vector3d(1.0, 1.0, 0.0), 4.0};
}

/// What M18 fig. 3.27 claims, on this arm: how far the hand ends from a moving target when motions
/// are mapped from goal and style, and from the goal alone.
reproduce::Report style_preserving_reach(const std::optional<std::filesystem::path>& plot_dir);

}  // namespace mimesis::synthesizer
