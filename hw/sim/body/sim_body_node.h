#pragma once
#include <array>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/robot/kinematics.h"
#include "common/robot/link_shapes.h"
#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "hw/joints/joints.h"
#include "hw/sim/body/body_params.h"
#include "hw/sim/body/body_world.h"
#include "hw/sim/body/drawer.h"
#include "hw/sim/body/outcome_messages.h"
#include "hw/sim/cia402/drive.h"
#include "proto/bridge.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/foxglove/transform.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::hw::sim {

/// The simulated body and its furniture for viewers: shapes on frames named after the links, sent
/// once and moved by transforms; forces, CoM and ZMP.
class BodyDrawing {
 public:
  /// `drawer`: empty: no furniture. @throws ConfigError if the URDF cannot be read
  BodyDrawing(const robot::Biped& biped, const std::string& urdf_file,
              const std::optional<DrawerSettings>& drawer);

  foxglove::SceneUpdate shapes(std::chrono::nanoseconds now) const;
  /// `q`: dof [rad]
  foxglove::FrameTransforms frames(const BodyTruth& truth, const Eigen::VectorXd& q,
                                   const DrawerNow* drawer, std::chrono::nanoseconds now);
  /// Forces of the ground as arrows of 1 m for 1000 N; CoM with its place on the ground; ZMP.
  static foxglove::SceneUpdate forces(const BodyTruth& truth, std::chrono::nanoseconds now);

 private:
  robot::Biped biped_;
  robot::Kinematics kinematics_;
  std::vector<robot::LinkShape> shapes_;
  std::vector<int> drawn_;  ///< links with shapes, and the root
  std::optional<DrawerSettings> drawer_;
};

/// A biped in a physics world behind simulated drives on CAN buses. Per step: the drives move their
/// motors' set-points, the world advances, the drives answer with its sensor readings.
class SimBodyNode {
 public:
  using Params = SimBodyParams;
  SimBodyNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  /// Motors get no more commands: the end of the simulation shows how the robot stopped.
  bool at_rest() const;

 private:
  void open_buses(runtime::Bus& bus);
  void make_trouble();
  void move_world(runtime::Time now);
  void move_drawer(double dt_s);
  void see_drawer(runtime::Time now);
  robot::Biped::Gripper gripper_of(const GripperParams& params, robot::Side side) const;
  bool closed(const robot::Biped::Gripper& gripper) const;
  void measure();
  void publish(runtime::Time now);

  Params params_;
  robot::Biped biped_;
  Joints joints_;
  BodyWorld world_;
  BodyDrawing drawing_;
  std::optional<Drawer> drawer_;
  std::optional<HeadCamera> camera_;
  std::array<robot::Biped::Gripper, 2> gripper_{};
  std::vector<std::unique_ptr<Rack>> racks_;
  std::vector<Drive*> drives_;  // drives of all racks, in the model's order
  std::vector<double> motors_;  // set-points [rad]
  std::optional<runtime::Time> last_;
  std::uint64_t steps_ = 0;
  std::size_t faults_made_ = 0;
  std::string trouble_;  // trouble of the world, reported last
  runtime::Throttle lags_{std::chrono::seconds(1)};

  runtime::Queue<v1::BodyTrouble, 16> troubles_;
  OutcomeJudge judge_;
  runtime::Out<v1::BodySensors> sensors_;
  runtime::Out<v1::BodyTruth> truth_;
  runtime::Out<v1::JointState> joint_states_;
  runtime::Out<v1::DrawerState> drawer_state_;
  runtime::Out<v1::HeadSight> sight_;
  runtime::Out<v1::HandTouch> touch_;
  runtime::Out<foxglove::SceneUpdate> entities_, forces_;
  runtime::Out<foxglove::FrameTransforms> transforms_;
  v1::BodySensors sensors_message_;
  v1::BodyTruth truth_message_;
  v1::JointState joint_states_message_;
  v1::DrawerState drawer_message_;
  v1::HeadSight sight_message_;
  v1::HandTouch touch_message_;
};

}  // namespace mimesis::hw::sim
