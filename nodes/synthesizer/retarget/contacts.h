#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "nodes/synthesizer/mocap/body_map.h"

namespace mimesis::retarget {

/// Two points of every foot that may stand on the ground.
enum GroundPoint { kHeel, kToe };

/// Which points of the feet stand on the ground in each frame: rows 2·side + GroundPoint.
using Contacts = Eigen::Array<bool, 4, Eigen::Dynamic>;

/// Places of heels and toes in W [m], rows 3·(2·side + GroundPoint), one column a frame.
Eigen::Matrix<double, 12, Eigen::Dynamic> ground_points(const mocap::BodyClip& clip);

/// Height of the ground that a clip was recorded on: what the lower point of the lower foot stands
/// on half of the time [m]. Recordings put it a few centimetres beside zero.
double ground_height(const mocap::BodyClip& clip);

/// A point stands while it is slower than 0.3 m/s and less than 4 cm above its own lowest level
/// (5th percentile). Breaks below 50 ms are closed, then contacts below 50 ms dropped.
Contacts find_contacts(const mocap::BodyClip& clip);

}  // namespace mimesis::retarget
