#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "nodes/camera/renderer.h"

namespace mimesis::camera {

/// A teacher's table, its light and a pair of cameras.
struct RandomScene {
  Picture picture;
  std::array<image::Camera, 2> cameras;  ///< left, right
};

/// Draws a scene from ranges around `usual`, whose demonstration it keeps: places and sizes of all
/// things, their colours, heights of bar and stands, table top, lamp, light, noise, blur; side,
/// size, tilt, skin and sleeve of the teacher's hand; clutter, some of it like skin, and a rod that
/// is carried past before the scene; places, directions and lenses of the cameras. The same seed
/// gives the same scene.
RandomScene random_scene(const Picture& usual, std::uint64_t seed);

/// Two cameras around a view, as people set them up: places, directions and lenses drawn. Whoever
/// does not like what they see moves them: another `attempt`.
std::array<image::Camera, 2> random_cameras(const image::View& usual, std::uint64_t seed,
                                            std::uint64_t attempt = 0);

/// The camera of a view, and one `baseline_m` to its right that looks at the same point.
std::array<image::Camera, 2> usual_cameras(const image::View& view, double baseline_m);

/// The cameras as a calibration would tell them: focal lengths off by 0.05 %, the common place by
/// 0.3 mm and 0.01°, the second camera against the first by 0.1 mm and 0.004° (standard deviations;
/// those of `mimesis calibrate` on real pairs).
std::array<image::Camera, 2> calibrated(const std::array<image::Camera, 2>& cameras,
                                        std::uint64_t seed);

/// Where somebody who teaches the colours would click: a few pixels of each thing.
struct Click {
  const char* name;  ///< object, bar, goal_high, goal_low
  int left, top, width, height;
};
Click click(const char* name, const Eigen::Vector3d& place_T, const image::Camera& camera);
std::vector<Click> clicks(const Picture& picture, const image::Camera& camera);

}  // namespace mimesis::camera
