#pragma once
#include <cstdint>
#include <vector>

#include "common/image/image.h"
#include "common/image/pinhole.h"
#include "nodes/camera/ray_scene.h"
#include "nodes/camera/teacher_script.h"

namespace mimesis::camera {

/// Position of the lamp, frame T [m]; shared by everything that is shaded.
inline const Eigen::Vector3d kLamp{-0.7, 1.9, 1.5};

/// Light on a surface: ambient plus Lambert's cosine, 0..1 [1].
float lambert(const Eigen::Vector3d& normal, const Eigen::Vector3d& to_lamp);

/// The empty table as the camera sees it: drawn once, then copied under the moving hand.
struct TablePicture {
  image::Image color;
  std::vector<float> depth;  ///< along the optical axis [m], per pixel
  std::vector<std::uint8_t>
      wood;  ///< 1 where the table top is seen: shadows of the hand fall there
};

/// Casts 4 rays a pixel, each with 4 shadow rays to an extended lamp: takes some tenths of a
/// second.
/// @param clutter number of small coloured things lying about, placed by `seed`
TablePicture draw_table(const TeacherTable& table, const image::Pinhole& camera, int clutter,
                        std::uint64_t seed);

}  // namespace mimesis::camera
