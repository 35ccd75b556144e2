#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "hw/bridge/bridge_params.h"
#include "hw/bridge/command_gate.h"
#include "hw/outside/recorded.h"
#include "proto/bridge.pb.h"
#include "proto/can.pb.h"
#include "proto/foxglove/joint_states.pb.h"

namespace mimesis::hw::bridge {

/// Joins the graph to a robot's joints and hand: set-points to frames and registers, and back.
/// Trusts no stream.
class BridgeNode {
 public:
  using Params = BridgeParams;
  BridgeNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  void stop(runtime::Time now) noexcept;  ///< quick stop of all joints; the hand keeps its object

 private:
  BridgeNode(runtime::Bus& bus, const std::pair<Params, Joints>& machine);
  static std::pair<Params, Joints> with_machine(Params params);
  void serve(runtime::Bus& bus);
  void take_stops(const Reading& arm);
  void publish_frames(runtime::Time now);
  void take_command(runtime::Time now, const Reading& arm);
  void step_hand(runtime::Time now);
  void publish_joint_states(runtime::Time now, const Reading& arm);
  void publish_status(runtime::Time now, const Reading& arm);

  Params params_;
  std::vector<std::string> names_;  // of the joints
  std::vector<double> ahead_;       // of the newest command
  CommandGate gate_;
  outside::FrameLog frames_;
  std::unique_ptr<Actuators> driver_;
  outside::StopInputs stop_inputs_;
  std::string stop_demanded_;         // by a level, in this step
  const Reading* reading_ = nullptr;  // of the last step
  std::unique_ptr<outside::RecordedHand> hand_driver_;
  modbus::HandSetpoint hand_setpoint_;
  modbus::HandReading hand_reading_;
  std::uint64_t steps_ = 0;
  runtime::Time status_due_{};
  v1::BridgeStatus status_message_;
  v1::JointState joint_states_message_;
  runtime::Throttle refusals_{std::chrono::seconds(1)};

  runtime::Latest<v1::JointCommand> command_;
  runtime::Latest<v1::HandCommand> hand_command_;
  runtime::Latest<v1::EmergencyStop> emergency_stop_;
  runtime::Out<v1::JointState> joint_states_;
  runtime::Out<v1::HandState> hand_;
  runtime::Out<foxglove::JointStates> joints_;
  runtime::Out<v1::BridgeStatus> status_;
  runtime::Out<v1::CanFrame> can_;
};

}  // namespace mimesis::hw::bridge
