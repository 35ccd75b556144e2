#pragma once
#include <Eigen/Core>
#include <array>

#include "common/motion/mocap/body.h"

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
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< centre of the feet's places in W [m]
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

/// Where the ankles of a figure go.
struct FootPaths {
  std::array<Eigen::Matrix3Xd, 2> ankle_W_m;  ///< by side, one column a frame
};

/// Paths of the ankles of `to` for a motion recorded above `ground`, lengths
/// scaled: feet keep their recorded orientation in W. While points of a foot stand, the foot turns
/// about them and they stay; a stance as a whole is where the recorded one was on average. In swing
/// the difference to the recorded path fades from one stance to the next. The ground of the new
/// motion is z = 0; nothing goes below.
FootPaths foot_paths(const mocap::BodyClip& recorded, const Ground& ground, double scale,
                     const mocap::Body& to, const Contacts& contacts);

/// A limb of two segments with a hinge-like middle joint: thigh and shank.
struct TwoSegments {
  Eigen::Vector3d upper_m, lower_m;  ///< knee in the hip's frame, ankle in the knee's frame
};

/// Orientations in W that put the end of a limb to a place.
struct LimbPosture {
  Eigen::Matrix3d R_upper, R_lower;
  /// How far the end stays from its goal [m]; zero unless the limb is too short (or folded).
  double miss_m = 0.0;
};

/// Moves the ankle to `goal_W`, the hip being at `hip_W`, starting from orientations in W that it
/// changes as little as needed: the middle joint bends in the plane in which it is bent now
/// (towards its y axis if it is straight), then the limb turns as a whole by the smallest rotation.
/// A knee bends forward (positive about y). Closed form; does not allocate.
LimbPosture reach(const TwoSegments& limb, const Eigen::Matrix3d& R_upper,
                  const Eigen::Matrix3d& R_lower, const Eigen::Vector3d& hip_W,
                  const Eigen::Vector3d& goal_W);

struct BodyMotion {
  mocap::BodyClip clip;  ///< on the ground z = 0
  Contacts contacts;
  double scale = 1.0;  ///< length of the legs, new : recorded
};

/// Mean horizontal speed of points of the feet while they stand [m/s].
double stance_speed(const mocap::BodyClip& clip, const Contacts& contacts);

/// The motion of another figure: rotations are kept, height and travel of the pelvis (the middle
/// between the hips) are scaled by the length of the legs. Feet stand still: a standing foot's
/// first point of contact stays where it met the ground, the next one where it comes down, and no
/// point goes below the ground; the legs follow (reach()), the pelvis comes down where they would
/// be too short. Between stances the correction fades into the next one.
/// @throws ConfigError if the clip has no frames, is not finite or a body has no legs
BodyMotion retarget(const mocap::BodyClip& recorded, const mocap::Body& to);

}  // namespace mimesis::retarget
