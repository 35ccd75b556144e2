#include "hw/sim/world/grasp.h"

#include <cmath>

namespace mimesis::world {
namespace {

bool between(double lo, double x, double hi) { return lo <= x && x <= hi; }

bool from_above(const HandShape& hand, const Eigen::Isometry3d& X_EO, const Cylinder& object) {
  const Eigen::Vector3d p = X_EO * Eigen::Vector3d(0, 0, object.height / 2);
  return -X_EO.linear()(2, 2) >= std::cos(hand.max_tilt) &&
         std::abs(p.x()) <= hand.aperture / 2 - object.radius && std::abs(p.y()) <= hand.pad &&
         between(-hand.palm, p.z(), hand.tips - hand.overlap);
}

bool from_the_side(const HandShape& hand, const Eigen::Isometry3d& X_EO, const Cylinder& object) {
  const Eigen::Vector3d p = X_EO.translation();
  return std::abs(X_EO.linear()(1, 2)) >= std::cos(hand.max_tilt) &&
         std::abs(p.x()) <= hand.aperture / 2 - object.radius &&
         std::abs(p.y()) <= object.height / 2 - hand.pad &&
         between(object.radius - hand.palm, p.z(), hand.tips - hand.overlap);
}

}  // namespace

GraspContact grasp_contact(const HandShape& hand, Grip grip, const Eigen::Isometry3d& X_WE,
                           const Cylinder& object) {
  GraspContact contact;
  contact.closure = 1.0 - 2.0 * object.radius / hand.aperture;
  if (grip == Grip::none || contact.closure < 0.0 || tilt(object) > hand.max_tilt) return contact;
  const Eigen::Isometry3d X_EO = X_WE.inverse() * object.X_WO;
  contact.reachable =
      grip == Grip::precision ? from_above(hand, X_EO, object) : from_the_side(hand, X_EO, object);
  return contact;
}

}  // namespace mimesis::world
