#include "hw/sim/world/world.h"

namespace mimesis::world {

World::World(kin::ArmModel arm, const kin::Table& table, const WorldShape& shape)
    : arm_(std::move(arm)),
      shape_(shape),
      object_(table, shape.fall),
      collisions_(arm_, table, shape.collision) {}

void World::step(double dt) { object_.step(dt); }

void World::step(double dt, const Eigen::Ref<const Eigen::VectorXd>& q, const Hand& hand) {
  kin::forward(arm_, q, X_);
  handle_object(tool(), hand);
  object_.step(dt);
  collisions_.update(X_, {.cylinder = object_.cylinder(),
                          .held = object_.state() == ObjectState::held,
                          .between_fingers = contact_.reachable,
                          .falling = object_.state() == ObjectState::falling});
  if (object_.state() == ObjectState::resting && object_.upright() &&
      collisions_.push().depth > shape_.knock) {
    object_.knock_over(collisions_.push().name);
  }
}

void World::handle_object(const Eigen::Isometry3d& X_WE, const Hand& hand) {
  if (object_.state() == ObjectState::held) {
    object_.carry(X_WE);
    if (hand.closure < contact_.closure - shape_.opening) object_.release();
    return;  // a held object stays between the fingers
  }
  contact_ = grasp_contact(shape_.hand, hand.grip, X_WE, object_.cylinder());
  if (contact_.reachable && object_.state() == ObjectState::resting &&
      hand.closure >= contact_.closure - shape_.closing_tolerance) {
    object_.grasp(X_WE);
  }
}

}  // namespace mimesis::world
