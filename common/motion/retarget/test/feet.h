#pragma once
#include <algorithm>
#include <cmath>

#include "common/motion/retarget/to_body.h"

namespace mimesis::retarget {

/// Heights above z = 0 of the lower point of a foot [m].
struct FootHeights {
  double standing_most = 0.0;  ///< largest |height| of a foot that stands
  double lowest = 1e9;         ///< height of the lowest foot
};
inline FootHeights foot_heights(const BodyMotion& motion) {
  const auto points = ground_points(motion.clip);
  FootHeights out;
  for (Eigen::Index t = 0; t < points.cols(); ++t) {
    for (const Eigen::Index side : {0, 1}) {
      const double low = std::min(points(6 * side + 2, t), points(6 * side + 5, t));
      out.lowest = std::min(out.lowest, low);
      if (!motion.contacts(2 * side, t) && !motion.contacts(2 * side + 1, t)) continue;
      out.standing_most = std::max(out.standing_most, std::abs(low));
    }
  }
  return out;
}

}  // namespace mimesis::retarget
