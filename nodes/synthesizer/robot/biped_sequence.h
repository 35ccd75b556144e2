#pragma once
#include <optional>
#include <string>

#include "common/math/circle.h"
#include "common/robot/drawer_size.h"
#include "common/robot/kinematics.h"
#include "nodes/synthesizer/robot/drawer_tracker.h"
#include "nodes/synthesizer/robot/robot_feedback.h"
#include "nodes/synthesizer/robot/robot_trials.h"
#include "nodes/synthesizer/sequence/action_maps.h"
#include "nodes/synthesizer/sequence/drawer_sequence.h"

namespace mimesis::synthesizer {

/// Knowledge of a robot for the drawer task: its learned actions, its skeleton, its size.
struct BipedDrawer {
  robot::RobotTree upper;  ///< upper_body_tree()
  retarget::RobotFigure figure;
  Drawer drawer;
  robot::DrawerSize size;
  StepPlanSettings plan;  ///< robot_step_plan()
  double pelvis_height_m = 0.65, feet_distance_m = 0.19;
  std::array<std::string, 2> gripper;  ///< joints that close the hands; empty: none
  ActionMaps actions;                  ///< rows: joints of `upper`, then kVelocityRows
};
inline constexpr DrawerModelOptions kSevenSources{.first_sources = 4, .further_sources = 3};
/// Trials, learning and maps: 2 s. @throws ConfigError as generate_robot_data(), ActionMaps
BipedDrawer make_biped_drawer(const robot::Biped& biped, const RobotTrialSettings& settings,
                              const DrawerModelOptions& options = kSevenSources);
/// Learns from trials with the settings of robot_trial_settings().
BipedDrawer make_biped_drawer(const robot::Biped& biped);
/// Learns from given training data, such as trajectories made feasible by a pattern generator.
BipedDrawer make_biped_drawer(const robot::Biped& biped, const DrawerData& data,
                              const DrawerModelOptions& options = kSevenSources);

struct BipedSequenceOptions {
  double dt_s = 1.0 / 200.0;
  std::optional<StepPlanSettings> plan;  ///< instead of BipedDrawer::plan
  /// duration of one step; of the weight shift before the first one
  double step_s = 0.8, shift_s = 0.8;
  double beta = 0.2;        ///< half width of a transition, of π [M18 eq. 3.23]
  double settle_s = 0.08;   ///< how fast the action under way takes new parameters
  double fixed_s = 0.3;     ///< time before a landing in which it is no longer changed
  double aside_m = 0.04;    ///< sideways part of a step, to a drawer that is not straight ahead
  double patience_s = 4.0;  ///< time limit of a hand that does not get its object
};

/// A wish for one hand: the point between its fingers.
struct HandWish {
  Eigen::Vector3d p_W_m = Eigen::Vector3d::Zero();
  double share = 0.0;   ///< 0: the joints decide; 1: the hand does
  bool closes = false;  ///< it shall grip
};

struct BipedSequenceState {
  double time_s = 0.0;
  Action action = kNormalStep;
  int number = 0;                                      ///< number of the action, from 0
  double phase_rad = 0.0, phase_rate_rad_s = 0.0;      ///< in the action, [0, 2π)
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< forward, left [m/s], turn [rad/s]
  Landings landing;
  bool stands = false;    ///< steps shall end
  Eigen::VectorXd q, dq;  ///< joints of BipedDrawer::upper [rad], [rad/s]
  std::array<std::optional<HandWish>, 2> hand;
  double opened_m = 0.0;    ///< wished opening of the drawer
  double distance_m = 0.0;  ///< middle of the feet to the closed front
  bool done = false;        ///< the object is in the hand
  std::string refused;      ///< why the task cannot be followed as it is; empty if it is
};

/// A robot's way to a drawer, online [M18 3.8]: action 1 as often as needed, action 2 with the left
/// hand's reach, standing: the left hand pulls, the right one takes the object. Gives a walker
/// landings of its feet and velocities of its pelvis, joints of the upper body from the learned
/// actions, and goals of the hands.
///
/// Loop: actions begin and end with the landings that the robot reports, and their phase is that of
/// its steps (GaitClock). At every landing, and when the drawer jumps, the steps are planned again
/// from where the feet are (plan_steps()). ArmReach corrects the distance of the mixture's hands
/// from handle and object; a hand that the robot reports elsewhere than wished is led back slowly.
/// A hand closes when it is there, with its gripper if it has one. One that closes on nothing hides
/// where its target is now: it goes aside until the camera has seen it. The drawer opens on as long
/// as it is held, and beyond the trials' 0.2 m while the right hand at its end does not reach the
/// object. Without feedback the robot is assumed to obey. From a drawer that is too near the robot
/// steps back, its hands withdrawn, which goes beyond [M18 3.8.4]. If no plan leads to the drawer
/// after a jump, the robot stops with the reason, until the drawer jumps again.
///
/// step() does not allocate but at the beginning of actions and after jumps.
class BipedDrawerSequence {
 public:
  /// The reason if no plan leads there. `drawer` must outlive the sequence. The robot may stand or
  /// walk; the way is straight to the drawer.
  static tl::expected<BipedDrawerSequence, Status> start(const BipedDrawer& drawer,
                                                         const DrawerPlace& task,
                                                         const RobotFeedback& robot,
                                                         const BipedSequenceOptions& options = {});

  /// The drawer (or the object) is elsewhere from now on; if it is seen, that counts. Why not, if
  /// it moved across the way: then the old place stays.
  std::string set_task(const DrawerPlace& task);
  /// A front that is too far across the way to be followed.
  bool across(const Eigen::Vector2d& front_W_m) const {
    return std::abs(on_way(front_W_m).y()) > kAcross_m;
  }
  /// Joints that the upper body comes from: what differs fades.
  void set_posture(const Eigen::VectorXd& q);

  /// Advances by dt. Null: there is none.
  const BipedSequenceState& step(const RobotFeedback* robot, const DrawerSeen* seen);
  const BipedSequenceState& state() const { return state_; }
  const DrawerPlace& task() const { return task_; }
  double heading_rad() const { return heading_; }  ///< heading of the way
  /// Place of the robot, reported or assumed.
  const RobotFeedback& robot() const { return robot_; }
  const std::vector<PlannedStep>& steps() const { return plan_.steps; }  ///< left to do
  /// Remaining actions, the current one first, with travels of the middle of the feet.
  std::vector<PlannedAction> plan() const;
  /// Actions that were walked, with the lengths that they came to have.
  const std::vector<PlannedAction>& history() const { return history_; }

  static constexpr double kAcross_m = 0.15;

 private:
  static constexpr double kPullFrom = 0.05, kPullTo = 0.65;  // shares of action 3: as in the trials

  BipedDrawerSequence(const BipedDrawer& drawer, const DrawerPlace& task,
                      const RobotFeedback& robot, const BipedSequenceOptions& options);
  // along and across the way
  Eigen::Vector2d on_way(const Eigen::Vector2d& p_W_m) const;
  Eigen::Vector2d in_world(const Eigen::Vector2d& p_way_m) const;
  double foot_m(mocap::Side side) const { return on_way(robot_.feet[side].p_W_m).x(); }
  double middle_m() const { return 0.5 * (foot_m(mocap::kLeft) + foot_m(mocap::kRight)); }
  double comfortable_m() const;

  void see(const RobotFeedback* robot);
  void see_drawer(const DrawerSeen* seen);
  void landed(mocap::Side side);
  void replan();
  void halt();
  void begin_action();
  Action played(std::size_t first) const;
  std::size_t end_of_action(std::size_t first) const;
  double middle_after(std::size_t step) const;
  bool leads_back(std::size_t first) const;
  MotionParameters parameters(std::size_t first, double start_m, double previous_m) const;
  MotionParameters wanted() const;
  MotionParameters following() const;
  void advance_phase(const DrawerSeen* seen);
  void stand_on(const DrawerSeen* seen);
  const MotionParameters& mix();
  void move_grippers();
  void move_upper_body();
  void wish_velocity();
  void wish_landings();
  SolePrint print(const PlannedStep& step, int steps_ahead) const;
  void start_hands();
  void look_again(const DrawerSeen* seen);
  void turn_hand(mocap::Side side, bool to_target, double duration_s);
  double share_of(mocap::Side side) const;
  void move_hands(const DrawerSeen* seen);
  Eigen::Vector3d steady_object(const DrawerSeen& seen, const Eigen::Vector3d& way) const;
  double over_front(double along_m, double z_m, const Eigen::Vector3d& front,
                    const Eigen::Vector3d& object) const;
  void draw_on(const Eigen::Vector3d& object_W_m, const Eigen::Vector3d& way);
  void move_hand(mocap::Side side, const Eigen::Vector3d& target, double over_m);
  void release(bool too_near);

  const BipedDrawer* drawer_;
  DrawerPlace task_;
  BipedSequenceOptions options_;
  StepPlanSettings plan_settings_;
  Eigen::Vector2d origin_;
  double heading_ = 0.0, front_m_ = 0.0, front_across_m_ = 0.0, across_m_ = 0.0;
  RobotFeedback robot_;  // feedback as reported, or as assumed
  BelievedRobot believed_;
  GaitClock clock_;
  robot::Kinematics kinematics_;
  std::array<int, 2> wrist_{};

  StepPlan plan_;
  std::vector<PlannedAction> history_;
  bool task_changed_ = false, was_moving_ = false, from_stand_ = true;
  mocap::Side last_swing_ = mocap::kRight;
  int last_steps_ = 0;
  double action_start_m_ = 0.0, previous_length_m_ = 0.0;

  ActionCourse course_;
  Eigen::VectorXd aim_;  // targets of the joints, before the low-pass
  Eigen::VectorXd rows_, soon_, offset_, offset_rate_, lower_, upper_;
  double fade_s_ = 0.0, waited_s_ = 0.0;
  double opened_off_m_ = 0.0;  // opened − wished of the measured drawer, low-passed
  bool fade_begins_ = true, halted_ = false, waiting_ = false;
  Action kind_ = kNormalStep;  // action that is played

  struct Hand {
    ArmReach reach;
    // rate of the share before it turned; time since then
    double turn_rate_1_s = 0.0, turned_s = 1e3;
    bool started = false;
    Eigen::Vector3d gap_m = Eigen::Vector3d::Zero(), gap_rate = Eigen::Vector3d::Zero(),
                    led_m = Eigen::Vector3d::Zero(), last_target_m = Eigen::Vector3d::Zero();
    bool has_target = false, closes = false;
    double near_s = 0.0;    // time at its target
    double missed_s = 0.0;  // time closed without getting it
    double aside_s = -1.0;  // time out of the camera's sight; negative: it is not
    bool leaves = false;    // goes to before the front first, until `leaves_s` are over
    double leaves_s = 0.0;
    int gripper = -1;  // joint
    double open_rad = 0.0, closed_rad = 0.0, gripper_rad = 0.0;
  };
  std::array<Hand, 2> hand_;
  BipedSequenceState state_;
};

}  // namespace mimesis::synthesizer
