#pragma once
#include <cmath>
#include <cstdint>
#include <string>

#include "common/kin/arm.h"
#include "common/kin/table.h"
#include "common/task/symbols.h"
#include "hw/sim/world/collisions.h"

namespace mimesis::world {

/// Length [m] for people: "34.2 mm".
inline std::string millimetres(double m) {
  const long tenths = std::lround(m * 1e4);
  return std::to_string(tenths / 10) + "." + std::to_string(std::labs(tenths % 10)) + " mm";
}

using task::Grip;

/// The open hand around frame E (z approach, x across the fingers), as the arm's safety balls draw
/// it.
struct HandShape {
  double aperture = 0.058;  ///< between the inner faces of the open fingers [m]
  double tips = 0.026;      ///< fingers end this far beyond E [m]
  double palm = 0.038;      ///< the palm ends this far before E [m]
  double pad = 0.016;       ///< half the width of a finger [m]
  double overlap = 0.005;   ///< fingers must reach this far past the held object [m]
  double max_tilt = 0.2;    ///< between the hand and the ideal grasp [rad]
};

/// Where the fingers would meet the object.
struct GraspContact {
  bool reachable = false;  ///< the object is between the fingers, in the manner of the grip
  double closure = 0.0;    ///< at which they hold it: 0 open .. 1 closed [1]
};

/// Geometry of a grasp of an upright cylinder. With p = the held point in E:
/// precision: fingers from above, z_E = −z_O, p = middle of the top: |p_x| ≤ ½aperture − r, |p_y| ≤
/// pad,
///   −palm ≤ p_z ≤ tips − overlap;
/// full: from the side, y_E = ±z_O, p = centre: |p_x| ≤ ½aperture − r, |p_y| ≤ ½h − pad,
///   −palm + r ≤ p_z ≤ tips − overlap.
/// Both fingers close evenly, aperture·(1 − closure), and push the object to the middle: they hold
/// it at closure = 1 − 2r / aperture. An object that lies cannot be grasped.
GraspContact grasp_contact(const HandShape& hand, Grip grip, const Eigen::Isometry3d& X_WE,
                           const Cylinder& object);

/// State of the object.
enum class ObjectState { resting, held, falling };

/// The object to be grasped, without dynamics of its own: it rests, moves with the hand, or falls
/// straight down on the highest box below its centre. It stays upright if it fell from at most
/// 2 cm, met nothing else on its way, and leaned by less than atan(r / ½h), where its centre
/// passes its rim; else it topples.
class ObjectModel {
 public:
  /// `table` gives the object, and what can carry it.
  explicit ObjectModel(const kin::Table& table);

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
  Cylinder cylinder_;
  Eigen::Isometry3d X_EO_ = Eigen::Isometry3d::Identity();
  ObjectState state_ = ObjectState::resting;
  bool upright_ = true, moved_ = false, was_held_ = false;
  std::string mishap_;
  double velocity_ = 0.0;    // downwards [m/s]
  double landing_z_ = 0.0;   // height of the support's surface
  std::string will_topple_;  // why, on landing; empty if not
};

/// End of the task according to the planner.
struct TaskEnd {
  bool done = false;   ///< false: failed
  std::string goal;    ///< "high", "low", or empty if none was decided
  std::string reason;  ///< reason of a failure
};

struct Verdict {
  bool placed = false;  ///< at rest, upright and released within the goal's radius, after a grasp
  double placement_error =
      -1.0;            ///< distance of the object's centre from the goal [m], -1 without goal
  std::string reason;  ///< reason of a failure; empty otherwise
};

/// Judges by the state of the object, not by the planner's report; the planner's reason explains a
/// failure. Precondition: the object does not fall.
Verdict judge(const TaskEnd& end, const ObjectModel& object,
              const std::vector<kin::GoalPlace>& goals);

struct Hand {
  Grip grip = Grip::unknown;
  double closure = 0.0;  ///< 0 open .. 1 closed [1]
};

/// True state of arm, hand, object and table: the role of the robot's world, and the view of a
/// judge.
class World {
 public:
  World(kin::ArmModel arm, const kin::Table& table);

  /// Advances by `dt` > 0 [s]. `q`: true joint positions (dof, [rad]).
  void step(double dt, const Eigen::Ref<const Eigen::VectorXd>& q, const Hand& hand);
  /// A step while the arm's posture is not known: only gravity acts.
  void step(double dt);

  const GraspContact& contact() const { return contact_; }
  const ObjectModel& object() const { return object_; }
  const CollisionMonitor& collisions() const { return collisions_; }
  /// frames of the arm, empty before the first step
  const std::vector<Eigen::Isometry3d>& frames() const { return X_; }
  /// precondition: frames() not empty
  Eigen::Isometry3d tool() const { return X_.back() * arm_.X_LE; }

 private:
  void handle_object(const Eigen::Isometry3d& X_WE, const Hand& hand);

  kin::ArmModel arm_;
  ObjectModel object_;
  CollisionMonitor collisions_;
  GraspContact contact_;
  std::vector<Eigen::Isometry3d> X_;
};

/// The object or the high goal if the arm cannot let its hand down on it from above, in words;
/// empty if it can. The hand points down, its fingers 20 mm below the top of an object that stands
/// there; at every 10 mm from there to 90 mm higher the arm must have a posture whose safety balls
/// are 5 mm clear of bar and boxes. Nothing is said about ways from one posture to the next:
/// that is for whoever plans. The low goal is behind the bar and reached from the side, where there
/// is room.
std::string out_of_reach(const kin::ArmModel& arm, const kin::Table& table);

/// `usual` with object, plinth, goals and stands up to 15 mm aside and stands up to 15 mm higher or
/// lower, drawn until nothing is out of reach. The same seed gives the same table.
/// @throws ConfigError if 100 draws are not enough
kin::Table random_table(const kin::ArmModel& arm, const kin::Table& usual, std::uint64_t seed);

}  // namespace mimesis::world
