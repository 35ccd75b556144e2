#pragma once
#include <array>

#include "common/motion/retarget/contacts.h"

namespace mimesis::retarget {

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

}  // namespace mimesis::retarget
