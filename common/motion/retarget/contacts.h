#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/motion/mocap/body_map.h"

namespace mimesis::retarget {

/// Two points of every foot that may stand on the ground.
enum GroundPoint { kHeel, kToe };

/// Which points of the feet stand on the ground in each frame: rows 2·side + GroundPoint.
using Contacts = Eigen::Array<bool, 4, Eigen::Dynamic>;

/// Places of heels and toes in W [m], rows 3·(2·side + GroundPoint), one column a frame.
Eigen::Matrix<double, 12, Eigen::Dynamic> ground_points(const mocap::BodyClip& clip);

/// The plane that a clip was recorded on. Recordings put it some centimetres beside z = 0, and
/// slightly tilted: 4 cm over 3 m in CMU 07_01.
struct Ground {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< of the feet's places in W [m]
  double height_m = 0.0;                             ///< there
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();   ///< [1]

  double below(const Eigen::Vector3d& p_W) const {
    return height_m + slope.dot(p_W.head<2>() - centre);
  }
};

/// Least squares through the lowest points of the feet while they move slower than 0.3 m/s; slopes
/// are held back where the feet stay within a few decimetres. Not for stairs.
Ground find_ground(const mocap::BodyClip& clip);

/// A point stands while it is slower than 0.3 m/s and less than 4 cm above the ground. Breaks below
/// 50 ms are closed, then contacts below 50 ms dropped.
Contacts find_contacts(const mocap::BodyClip& clip, const Ground& ground);

}  // namespace mimesis::retarget
