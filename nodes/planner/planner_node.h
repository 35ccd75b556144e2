#pragma once
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "nodes/planner/planner_requests.h"
#include "nodes/planner/task_plan.h"
#include "nodes/planner/task_sequence.h"
#include "proto/bridge.pb.h"
#include "proto/cognition.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "proto/planner.pb.h"
#include "proto/scene.pb.h"

namespace mimesis::planner {

/// Messages <-> the planner's own types. None of the symbols is unspecified.
Task to_task(v1::Grip grip, v1::Transport transport, v1::Goal goal);
/// Empty: not settled, or a part of the decision is unknown.
std::optional<Order> to_decided(const v1::Decision& decision);
/// Empty if the number of joints is not `dof`.
std::optional<ArmReading> to_reading(const v1::JointState& state, int dof);
HandReading to_reading(const v1::HandState& state);

v1::TaskState to_proto(TaskSequence::State state);
v1::TaskPhase to_proto(Phase phase);
/// Without header. @param carried number of postures that tell the way with the object
v1::TaskStatus to_status(const TaskSequence& sequence, int carried = 0);
v1::Trajectory to_proto(const PlannedMotion& motion);

struct PlannerParams {
  double rate_hz = 200.0;           ///< rate of set-points: the robot's [Hz]
  double offset_s = 0.0;            ///< time of the first step within the period [s]
  std::string robot = "lwr4.yaml";  ///< model file of the arm
  std::string table{};          ///< file of what stands there until a scene comes; empty: it waits
  int roadmap_nodes = 2500;     ///< number of nodes sampled within the joint limits [1]
  int neighbours = 4;           ///< links of a node, k [1]
  int seed = 1;                 ///< seed of all sampling [1]
  double margin_m = 0.002;      ///< least distance of safety balls [m]
  double wide_margin_m = 0.01;  ///< the same where there is room: tried first [m]
  double approach_m = 0.09;     ///< length of the straight motion to and from the object [m]
  double lift_m = 0.05;         ///< height of the straight lift and lowering of the object [m]
  double precision_depth_m = 0.02;  ///< object's top above the grasp centre in a precision grip [m]
  double lean_rad = 0.15;  ///< most that the hand leans where it cannot point as it should [rad]
  double speed = 0.6;      ///< share of the arm's velocity and acceleration limits [1]
  /// share of the limits for straight motions to and from contact [1]
  double contact_speed = 0.3;
  double stale_s = 0.1;           ///< older states of arm or hand stop the task [s]
  double upstream_s = 0.06;       ///< older scenes or decisions make the arm wait; 0: never [s]
  double ready_s = 10.0;          ///< longest wait for scene, arm and hand [s]
  bool has_hand = true;           ///< false: the arm moves, and takes nothing
  double hand_s = 5.0;            ///< longest time of the hand to open or close [s]
  double tracking_rad = 0.25;     ///< largest allowed following error [rad]
  double object_moved_m = 0.005;  ///< motion of the object that causes a new plan [m]
  double grip_force = 0.5;        ///< commanded force, 0 .. 1 [1]
  int carried_postures = 0;       ///< postures of the way with the object in the status [1]

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v.file("robot", robot, "arm");
    v.file("table", table, "table");
    v("roadmap_nodes", roadmap_nodes, 100, 20000);
    v("neighbours", neighbours, 2, 32);
    v("seed", seed, 0, 1'000'000'000);
    v("margin_m", margin_m, 0.0, 0.05);
    v("wide_margin_m", wide_margin_m, 0.0, 0.1);
    v("approach_m", approach_m, 0.02, 0.3);
    v("lift_m", lift_m, 0.02, 0.3);
    v("precision_depth_m", precision_depth_m, 0.0, 0.2);
    v("lean_rad", lean_rad, 0.0, 0.5);
    v("speed", speed, 0.05, 0.95);
    v("contact_speed", contact_speed, 0.05, 0.95);
    v.changeable([&] {
      v("stale_s", stale_s, 0.02, 2.0);
      v("upstream_s", upstream_s, 0.0, 60.0);
    });
    v("ready_s", ready_s, 0.1, 100.0);
    v("has_hand", has_hand);
    v("hand_s", hand_s, 0.1, 60.0);
    v("tracking_rad", tracking_rad, 0.01, 1.0);
    v("object_moved_m", object_moved_m, 0.001, 0.1);
    v("grip_force", grip_force, 0.0, 1.0);
    v("carried_postures", carried_postures, 0, 100);
  }
  double robot_rate_hz() const;  ///< see run_node
};

/// Settings of the plan from these parameters: with them another program can make the same roadmap.
TaskSettings task_settings(const PlannerParams& params);

/// The way of the hand in all motions of a plan, in W: blue empty, violet holding, with the hand's
/// axes at grasp and release. One entity, "plan".
foxglove::SceneUpdate draw_plan(const kin::ArmModel& arm, const TaskPlan& plan,
                                std::chrono::nanoseconds stamp);

/// What planning knows of the table, in W: object, goals and bar where they were seen, each with an
/// ellipsoid of three standard deviations and the largest of them in words. One entity, "seen".
foxglove::SceneUpdate draw_seen(const v1::Scene& scene, std::chrono::nanoseconds stamp);

/// Plans the decided task and streams it to the bridge. Its ports are its interface.
class PlannerNode {
 public:
  using Params = PlannerParams;
  PlannerNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);  ///< called at rate_hz
  void change(const Params& params) { params_ = params; }

 private:
  void read_inputs(runtime::Time now);
  void place_obstacles();
  tl::expected<v1::ObstacleNames, Status> add(const v1::Obstacle& obstacle);
  std::string missing(runtime::Time now);
  int periods_since_last(runtime::Time now);
  void take_plan();
  void advance(runtime::Time now);
  void publish_commands(runtime::Time now);
  void publish_trajectory(runtime::Time now);
  std::string waits_for(runtime::Time now);
  void publish_status(runtime::Time now);
  void publish_drawings(runtime::Time now);

  Params params_;
  kin::ArmModel arm_;
  TaskSettings settings_;
  TaskSequence sequence_;
  PlanningJob job_;
  std::optional<PlanRequest> waiting_request_;
  std::shared_ptr<const Roadmap> roadmap_;  // of the scene planned last
  double compute_s_ = 0.0;
  bool undrawn_ = false;  // a plan that viewers have not got

  std::optional<Order> decided_;
  std::uint64_t begun_ = 0;          // id of the last decision that was begun, or shall never be
  std::optional<kin::Table> table_;  // with what services added
  std::optional<kin::Table> given_;  // without
  std::map<std::string, v1::Obstacle> obstacles_;  // that services added
  bool undrawn_obstacles_ = false;
  std::optional<ArmReading> arm_reading_;
  runtime::Throttle unlike_{std::chrono::seconds(1)}, unusable_{std::chrono::seconds(1)},
      waits_{std::chrono::seconds(1)};
  std::optional<HandReading> hand_reading_;
  v1::TaskStatus last_status_;
  std::string awaited_;  // what it waits for at rest
  runtime::Time awaited_since_{};
  runtime::Time status_due_{}, seen_due_{}, pose_due_{};
  std::vector<Eigen::Isometry3d> X_;     // of the links
  std::optional<double> drawn_closure_;  // of the hand [1]
  runtime::Time even_{};                 // of the last step, without what it was late

  runtime::Latest<v1::Decision> decision_in_;
  runtime::Latest<v1::Scene> scene_in_;
  runtime::Latest<v1::JointState> arm_in_;
  runtime::Latest<v1::HandState> hand_in_;
  runtime::Out<v1::JointCommand> command_;
  runtime::Out<v1::HandCommand> hand_command_;
  runtime::Out<v1::TaskStatus> status_;
  runtime::Out<v1::Trajectory> trajectory_;
  Requests requests_;
  // For viewers:
  runtime::Out<foxglove::SceneUpdate> plan_, seen_, robot_;
  runtime::Out<foxglove::FrameTransforms> robot_frames_;
};

}  // namespace mimesis::planner
