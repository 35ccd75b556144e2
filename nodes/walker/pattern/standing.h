#pragma once
#include "nodes/walker/pattern/preview_control.h"

namespace mimesis::walker {

/// Brings the CoM to rest above a point, by the state feedback of preview control without preview.
class Standing {
 public:
  explicit Standing(double height_m);
  ComState after(ComState com, const Eigen::Vector2d& middle_W_m, int ticks) const;
  /// So near to rest there that this feedback keeps the ZMP well between the feet.
  static bool settled(const ComState& com, const Eigen::Vector2d& middle_W_m);

 private:
  Eigen::RowVector3d gain_;
};

/// Share of the weight on the left foot: where the ZMP is between the ankles; 0 or 1 on one foot.
double left_share(const PatternSample& sample);

}  // namespace mimesis::walker
