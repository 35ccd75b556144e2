#pragma once
#include "nodes/walker/tasks/stack.h"

namespace mimesis::walker {

/// How far the base and the joints may move within one tick.
class Limits {
 public:
  Limits(const robot::Biped& biped, const StackSettings& settings);

  /// Of displacements of base and joints from q within dt; lower ≤ upper.
  void bounds(const Eigen::Ref<const Eigen::VectorXd>& q, double dt_s,
              Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const;
  const Eigen::VectorXd& lower() const { return lower_; }  ///< positions with margins
  const Eigen::VectorXd& upper() const { return upper_; }

 private:
  void keep_knees_bent(const robot::Biped& biped, double margin_rad);
  Eigen::VectorXd lower_, upper_, speed_;
};

}  // namespace mimesis::walker
