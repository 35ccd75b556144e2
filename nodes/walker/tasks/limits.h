#pragma once
#include "nodes/walker/tasks/stack.h"

namespace mimesis::walker {

/// How far the base and the joints may move within one tick: to a limit no faster than by e⁻¹ of
/// what is left in 20 ms, back from beyond it in the same way.
class Limits {
 public:
  /// @throws ConfigError that names the setting and what was expected
  Limits(const robot::Biped& biped, const StackSettings& settings);

  /// Of displacements within dt from the joints' positions q (dof [rad]): `lower` ≤ `upper`, 6 +
  /// dof, of the base [m], [rad] in W, then of the joints [rad].
  void bounds(const Eigen::Ref<const Eigen::VectorXd>& q, double dt_s,
              Eigen::Ref<Eigen::VectorXd> lower, Eigen::Ref<Eigen::VectorXd> upper) const;
  const Eigen::VectorXd& lower() const { return lower_; }  ///< positions with margins, dof [rad]
  const Eigen::VectorXd& upper() const { return upper_; }  ///< likewise

 private:
  void keep_knees_bent(const robot::Biped& biped, double margin_rad);
  Eigen::VectorXd lower_, upper_, speed_;
};

}  // namespace mimesis::walker
