#pragma once
#include <string>

#include "hw/sim/world/shapes.h"

namespace mimesis::world {

struct FallLimits {
  double gravity = 9.81;   ///< [m/s²]
  double max_drop = 0.02;  ///< from higher the object topples on landing [m]
  double floor_z = -0.76;  ///< of the room, beside the table [m]
  double sink_tolerance =
      0.005;  ///< a support this far above the object's lowest point still carries it [m]
};

/// What became of the object so far.
enum class ObjectState { resting, held, falling };

/// The object to be grasped, without dynamics of its own: it rests, moves with the hand, or falls
/// straight down on the highest box below its centre. It stays upright if it fell from at most
/// max_drop, met nothing else on its way, and leaned by less than atan(r / ½h), where its centre
/// passes its rim; else it topples.
class ObjectModel {
 public:
  /// `table` gives the object, and what can carry it.
  ObjectModel(const kin::Table& table, const FallLimits& limits);

  /// Fixes the object to the hand, centred between the fingers (x_E). Precondition: not held.
  void grasp(const Eigen::Isometry3d& X_WE);
  /// Moves it with the hand. Precondition: held.
  void carry(const Eigen::Isometry3d& X_WE);
  /// Lets it go. Precondition: held.
  void release();
  /// Falls: v ← v + g·dt, z ← z − v·dt − ½g·dt². `dt` > 0 [s].
  void step(double dt);
  /// Pushed by something else than the fingers: topples where it stands. Precondition: not held.
  void knock_over(const std::string& by);

  ObjectState state() const { return state_; }
  const Cylinder& cylinder() const { return cylinder_; }
  bool upright() const { return upright_; }
  bool moved() const { return moved_; }  ///< was held or knocked over since the start
  bool was_held() const { return was_held_; }
  /// Why it does not stand as it was meant to; empty while nothing went wrong.
  const std::string& mishap() const { return mishap_; }

 private:
  void plan_landing();
  void land();

  std::vector<kin::Box> boxes_;
  std::vector<kin::Ball> balls_;
  FallLimits limits_;
  Cylinder cylinder_;
  Eigen::Isometry3d X_EO_ = Eigen::Isometry3d::Identity();
  ObjectState state_ = ObjectState::resting;
  bool upright_ = true, moved_ = false, was_held_ = false;
  std::string mishap_;
  double velocity_ = 0.0;    // downwards [m/s]
  double landing_z_ = 0.0;   // of the support's surface
  std::string will_topple_;  // why, on landing; empty if not
};

}  // namespace mimesis::world
