#pragma once
#include <optional>
#include <string>
#include <vector>

#include "nodes/synthesizer/character/characters.h"
#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/sequence/action_course.h"
#include "nodes/synthesizer/sequence/action_maps.h"
#include "nodes/synthesizer/sequence/action_plan.h"
#include "nodes/synthesizer/sequence/limbs.h"

namespace mimesis::synthesizer {

/// Where the task is. The drawer's front is the plane x = front_W_m; the way is along x of W.
struct DrawerGoal {
  double front_W_m = 2.6;
  double object_depth_m = 0.25, object_lateral_m = 0.0;  ///< place of the object, as in TrialPlan
  bool operator==(const DrawerGoal&) const = default;
};

struct SequenceOptions {
  double dt_s = 1.0 / 200.0;
  PlanSettings plan;
  double beta = 0.2;       ///< half width of a transition, of π [M18 eq. 3.23]
  double settle_s = 0.08;  ///< how fast the action under way takes new parameters
};

/// State after a step. W: pelvis starts above x = y = 0.
struct SequenceState {
  double time_s = 0.0;
  Action action = kNormalStep;
  int number = 0;             ///< number of the action, from 0
  double phase_rad = 0.0;     ///< phase of the leading oscillator in the action, [0, 2π)
  Eigen::VectorXd angle_rad;  ///< 51, rows of the body
  Eigen::Vector3d pelvis_W_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d handle_W_m = Eigen::Vector3d::Zero(), object_W_m = Eigen::Vector3d::Zero();
  double left_error_m = 0.0, right_error_m = 0.0;  ///< finger tips to handle and object
  /// Errors before the arm's correction: of the mixture alone.
  double left_without_m = 0.0, right_without_m = 0.0;
  std::array<bool, 2> stands{};
  double correction_m = 0.0;  ///< correction of the feet, against the mixture
  bool done = false;          ///< the object is in the hand
  std::string refused;        ///< why the last goal could not be followed; empty if it is
};

/// Walks to a drawer, opens it and takes the object in it [M18 3.7], online: the plan's actions one
/// after the other over the phase of the leading oscillator (on its limit cycle: φ̇ = ω), weights
/// and means from the maps of lengths and durations, transitions by eq. 3.23, arm reaches started
/// by events. The pelvis travels each action's length exactly; the learned rows pelvis.x, .y and .z
/// shape it. A goal that jumps is followed at once: the action under way takes the length that the
/// new plan gives it, further actions follow. Deterministic. A step takes some 20 µs, and some
/// tenths of a ms more when the maps are asked: at a boundary of actions and after a jump.
class DrawerSequence {
 public:
  /// The reason if no plan leads to the goal. `maps` must outlive the sequence.
  static tl::expected<DrawerSequence, Status> start(const ActionMaps& maps, const DrawerGoal& goal,
                                                    const SequenceOptions& options = {});

  /// The drawer (or the object) is elsewhere from now on.
  void set_goal(const DrawerGoal& goal);
  /// Advances by dt. After `done` only the clock moves.
  const SequenceState& step();
  const SequenceState& state() const { return state_; }
  /// Remaining actions, the current one first.
  const std::vector<PlannedAction>& plan() const { return plan_; }
  /// Actions begun so far, with their final lengths.
  const std::vector<PlannedAction>& history() const { return history_; }
  double distance_m() const { return goal_.front_W_m - state_.pelvis_W_m.x(); }

 private:
  DrawerSequence(const ActionMaps& maps, const DrawerGoal& goal, const SequenceOptions& options,
                 std::vector<PlannedAction> plan);
  void follow_goal();
  void begin_action();
  MotionParameters parameters(std::size_t index) const;
  void advance_phase();
  Eigen::VectorXd mixed();
  void move_pelvis(const Eigen::VectorXd& rows);
  void move_drawer();
  void move_hands();

  const ActionMaps* maps_;
  DrawerGoal goal_;
  SequenceOptions options_;
  std::vector<PlannedAction> plan_, history_;
  SequenceState state_;
  bool goal_changed_ = false;
  ActionCourse course_;
  double previous_length_m_ = 0.0;
  double start_x_m_ = 0.0, even_m_ = 0.0;       // start of the action; even progress in it
  std::optional<Eigen::VectorXd> left_behind_;  // posture that fades after an interrupted stand
  double left_behind_s_ = 0.0;
  FootHold feet_;
  ArmReach left_, right_;
  // Targets of the hands, and their remaining distance from a target that has jumped.
  Eigen::Vector3d left_aim_W_m_ = Eigen::Vector3d::Zero(), left_gap_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d right_aim_W_m_ = Eigen::Vector3d::Zero(), right_gap_m_ = Eigen::Vector3d::Zero();
  bool left_started_ = false, right_started_ = false;
  double opened_m_ = 0.0;
};

/// A drawer in the world: the middle of its closed front, which faces the character.
struct DrawerPlace {
  Eigen::Vector2d front_W_m = Eigen::Vector2d::Zero();
  double object_depth_m = 0.2;
  bool operator==(const DrawerPlace&) const = default;
};

/// The way of one character to a drawer: a DrawerSequence laid into the world, from where the
/// character is, straight towards the drawer.
class PlacedSequence {
 public:
  /// The reason if no trained sequence of actions leads there. `maps` must outlive the run.
  static tl::expected<PlacedSequence, Status> start(const ActionMaps& maps,
                                                    const DrawerPlace& place,
                                                    const Eigen::Vector2d& from_W_m, double dt_s);

  /// The drawer is elsewhere. The reach of the arm compensates its move across the way, up to
  /// kAcross_m: farther aside the new place is refused with the reason, and the old one stays.
  std::string move(const DrawerPlace& place);
  /// Advances by dt. Allocates.
  void step();

  const DrawerPlace& place() const { return place_; }
  const SequenceState& sequence() const { return sequence_.state(); }
  const std::vector<PlannedAction>& plan() const { return sequence_.plan(); }
  double heading_rad() const { return heading_rad_; }
  Eigen::Vector2d position_W_m() const;
  double distance_m() const { return sequence_.distance_m(); }  ///< pelvis to the front
  const char* action() const;                                   ///< "step", "reach" or "take"

  static constexpr double kAcross_m = 0.15;

 private:
  PlacedSequence(DrawerSequence sequence, const DrawerPlace& place, const Eigen::Vector2d& from_W_m,
                 double heading_rad)
      : sequence_(std::move(sequence)), place_(place), from_(from_W_m), heading_rad_(heading_rad) {}

  DrawerSequence sequence_;
  DrawerPlace place_;
  Eigen::Vector2d from_;  // where its way begins, W
  double heading_rad_;    // heading of its way
};

}  // namespace mimesis::synthesizer
