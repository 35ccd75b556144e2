#pragma once
#include "nodes/walker/pattern/pattern.h"
#include "nodes/walker/stabilizer/polygon.h"
#include "nodes/walker/stabilizer/sensors.h"

namespace mimesis::walker {

/// Where a ZMP can be while the planned feet carry, and what each foot has to give for it
/// [walking.md 8.6.4-8.6.5].
class Ground {
 public:
  /// @param margin_m  inside the edges of the soles
  Ground(const robot::Biped& biped, double margin_m) : biped_(&biped), margin_(margin_m) {}

  /// Point of the support polygon that is nearest to `zmp_W_m`.
  Eigen::Vector2d reachable(const PatternSample& plan, const Eigen::Vector2d& zmp_W_m) const;

  struct Shares {
    double left = 0.5;                       ///< of the weight
    std::array<Eigen::Vector2d, 2> cop_S_m;  ///< centre of pressure wished under each foot
  };
  /// `zmp_W_m` is split along the line between the ankles; what is left over is wished under both
  /// feet alike, cut to the soles.
  Shares distribute(const PatternSample& plan, const Eigen::Vector2d& zmp_W_m) const;

 private:
  Eigen::Vector2d on_sole(Side side, const Eigen::Vector2d& p_S_m) const;

  const robot::Biped* biped_;
  double margin_;
};

/// ZMP of both feet's wrenches, as if they stood where the plan has them; nothing below
/// `least_n` of normal force.
std::optional<Eigen::Vector2d> measured_zmp(const PatternSample& plan,
                                            const std::array<robot::Wrench, 2>& foot_S,
                                            double least_n);

}  // namespace mimesis::walker
