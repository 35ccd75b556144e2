#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "hw/sim/world/world.h"
#include "proto/bridge.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "proto/planner.pb.h"
#include "proto/scene.pb.h"
#include "proto/world.pb.h"

namespace mimesis::world {

struct WorldParams {
  double rate_hz = 100.0;                ///< step rate [Hz]
  double offset_s = 0.0;                 ///< time of the first step within the period [s]
  std::string robot = "lwr4.yaml";       ///< arm, in models/
  std::string table = "bar_table.yaml";  ///< table, in models/
  double bar_height_m = 0.0;          ///< lower edge of the bar above the table; 0: the file's [m]
  std::string goal_blocked = "none";  ///< puts a box on that goal: none, high or low
  std::vector<double> object_offset_m{
      0.0, 0.0};                ///< moves the object from its place in the file, x y [m]
  std::string scene = "usual";  ///< usual, or random: all things elsewhere, drawn with the seed
  int seed = 1;                 ///< seed of a random scene
  double settle_s = 0.5;        ///< from the task's end to the verdict [s]
  double retry_s = 1.5;  ///< from a task's failure to the verdict: another decision may follow [s]
  double stale_s = 0.2;  ///< older states of arm or hand silence the contact [s]

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 1.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v.file("robot", robot, "arm");
    v.file("table", table, "table");
    v("bar_height_m", bar_height_m, 0.0, 2.0);
    v("goal_blocked", goal_blocked, {"none", "high", "low"});
    v("object_offset_m", object_offset_m, -0.02, 0.02, 2);
    v("scene", scene, {"usual", "random"});
    v("seed", seed, 0, 1 << 30);
    v("settle_s", settle_s, 0.0, 60.0);
    v("retry_s", retry_s, 0.0, 60.0);
    v.changeable([&] { v("stale_s", stale_s, 0.01, 10.0); });
  }
};

/// The robot's world: tells the hand which object is between its fingers, and judges the trial.
class WorldNode {
 public:
  using Params = WorldParams;
  WorldNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  void change(const Params& params) { params_ = params; }

 private:
  void read_posture();
  bool inputs_fresh(runtime::Time now);
  Hand read_hand();
  void follow_task(runtime::Time now);
  void publish_state(runtime::Time now);
  void publish_scene(runtime::Time now);
  void publish_outcome(runtime::Time now);

  Params params_;
  kin::ArmModel arm_model_;
  kin::Table table_;
  World world_;
  std::optional<Eigen::VectorXd> q_;  // newest true posture
  std::optional<runtime::Time> last_step_, task_ended_;
  TaskEnd task_end_;
  v1::Goal goal_ = v1::GOAL_UNSPECIFIED;
  v1::Scene scene_message_;
  runtime::Time scene_sent_{};
  bool scene_due_ = true, outcome_sent_ = false, wrong_size_reported_ = false;
  int collisions_said_ = 0;

  runtime::Latest<v1::JointState> arm_;
  runtime::Latest<v1::HandState> hand_;
  runtime::Reliable<v1::TaskStatus> task_;
  runtime::Out<v1::Scene> scene_;
  runtime::Out<v1::WorldState> state_;
  runtime::Out<v1::HandContact> contact_;
  runtime::Out<foxglove::FrameTransforms> transforms_;
  runtime::Out<foxglove::SceneUpdate> entities_;
  runtime::Out<v1::TrialOutcome> outcome_;
};

}  // namespace mimesis::world
