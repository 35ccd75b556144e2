#pragma once
#include <optional>

#include "hw/sim/world/collisions.h"
#include "hw/sim/world/object.h"

namespace mimesis::world {

struct WorldShape {
  HandShape hand;
  FallLimits fall;
  CollisionTolerance collision;
  double closing_tolerance =
      0.008;              ///< below the contact's closure that still holds, two steps of 8 bits [1]
  double opening = 0.03;  ///< below the contact's closure at which the object is let go [1]
  double knock = 0.005;   ///< a push deeper than this knocks the object over [m]
};

/// True state of the hand.
struct Hand {
  Grip grip = Grip::none;
  double closure = 0.0;  ///< 0 open .. 1 closed [1]
};

/// True state of arm, hand, object and table: the role of the robot's world, and the view of a
/// judge.
class World {
 public:
  World(kin::ArmModel arm, const kin::Table& table, const WorldShape& shape);

  /// Advances by `dt` > 0 [s]. `q`: true joint positions (dof, [rad]).
  void step(double dt, const Eigen::Ref<const Eigen::VectorXd>& q, const Hand& hand);
  /// A step while the arm's posture is not known: only gravity acts.
  void step(double dt);

  const GraspContact& contact() const { return contact_; }
  const ObjectModel& object() const { return object_; }
  const CollisionMonitor& collisions() const { return collisions_; }
  const std::vector<Eigen::Isometry3d>& frames() const {
    return X_;
  }  ///< frames of the arm, empty before the first step
  Eigen::Isometry3d tool() const {
    return X_.back() * arm_.X_LE;
  }  ///< precondition: frames() not empty

 private:
  void handle_object(const Eigen::Isometry3d& X_WE, const Hand& hand);

  kin::ArmModel arm_;
  WorldShape shape_;
  ObjectModel object_;
  CollisionMonitor collisions_;
  GraspContact contact_;
  std::vector<Eigen::Isometry3d> X_;
};

}  // namespace mimesis::world
