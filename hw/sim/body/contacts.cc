#include "hw/sim/body/contacts.h"

#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/CollisionResult.hpp>
#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/ShapeNode.hpp>
#include <dart/simulation/World.hpp>

namespace mimesis::hw::sim {
namespace {

const dart::dynamics::BodyNode* body_of(const dart::collision::CollisionObject* object) {
  const auto* node = object->getShapeFrame()->asShapeNode();
  return node != nullptr ? node->getBodyNodePtr().get() : nullptr;
}

}  // namespace

GroundContact read_contacts(const DartBody& body, const robot::Biped& biped,
                            const std::array<Eigen::Isometry3d, 2>& X_WS) {
  GroundContact out;
  for (const auto& contact : body.world->getLastCollisionResult().getContacts()) {
    const auto* first = body_of(contact.collisionObject1);
    const auto* second = body_of(contact.collisionObject2);
    for (const robot::Side side : robot::kSides) {
      const auto* foot = body.at(biped.leg[side].foot).node;
      if (first != foot && second != foot) continue;
      const Eigen::Vector3d force_W = first == foot ? contact.force : -contact.force;
      const Eigen::Vector3d force_S = X_WS[side].linear().transpose() * force_W;
      out.foot_S[side].force += force_S;
      out.foot_S[side].moment += (X_WS[side].inverse() * contact.point).cross(force_S);
      out.weighted_W += contact.point.head<2>() * force_W.z();
      out.vertical_n += force_W.z();
    }
  }
  return out;
}

}  // namespace mimesis::hw::sim
