#pragma once
#include <memory>
#include <string>
#include <vector>

#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "hw/arm/group_driver.h"
#include "hw/bridge/command_gate.h"
#include "hw/joints/joints.h"
#include "hw/outside/recorded_hand.h"
#include "proto/arm.pb.h"
#include "proto/foxglove/joint_states.pb.h"

namespace mimesis::hw::bridge {

struct BridgeParams {
  double rate_hz = 200.0;             ///< of SYNC and of steps [Hz]
  double offset_s = 0.0;              ///< of the first step within the period [s]
  std::string robot = "lwr4.yaml";    ///< model file: limits, order of joints
  double a_max_rad_s2 = 300.0;        ///< of a walking robot's joints [rad/s²]
  std::string can = "embedded:arm";   ///< bus of the drives, see hw/can/bus.h
  std::vector<BusShare> buses{};      ///< several buses, instead of `can`
  std::string hand = "unix:hand";     ///< tcp:HOST:PORT, unix:NAME, or empty for no hand
  bool readonly = false;              ///< listens to the drives and sends nothing; no hand
  double silence_s = 0.1;             ///< no command for longer: the stream has ended [s]
  std::string on_silence = "auto";    ///< then: quick_stop, hold; auto: hold if the robot walks
  double start_tolerance_rad = 0.02;  ///< of a stream's first command from the actual posture [rad]
  double jump_rad = 0.1;              ///< largest jump within a stream beyond v_max [rad]
  double boot_timeout_s = 2.0;        ///< until missing drives are reported [s]
  double transition_timeout_s = 0.5;  ///< per change of a drive's state [s]
  double feedback_timeout_s = 0.1;    ///< without feedback a drive is lost [s]
  std::vector<arm::Axis> axes{};      ///< empty: nodes 1..n with defaults

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v("robot", robot);
    v("a_max_rad_s2", a_max_rad_s2, 1.0, 1e5);
    v("can", can);
    runtime::list(v, "buses", buses);
    v("hand", hand);
    v("readonly", readonly);
    v("silence_s", silence_s, 0.01, 1.0);
    v("on_silence", on_silence, {"auto", "quick_stop", "hold"});
    v("start_tolerance_rad", start_tolerance_rad, 0.001, 0.2);
    v("jump_rad", jump_rad, 0.001, 1.0);
    v("boot_timeout_s", boot_timeout_s, 0.1, 60.0);
    v("transition_timeout_s", transition_timeout_s, 0.05, 10.0);
    v("feedback_timeout_s", feedback_timeout_s, 0.01, 1.0);
    runtime::list(v, "axes", axes);
  }
};

/// Joins the graph to a robot's joints and hand: set-points to frames and registers, and back.
/// Trusts no stream.
class BridgeNode {
 public:
  using Params = BridgeParams;
  BridgeNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  void stop(
      runtime::Time now) noexcept;  ///< quick stop of all joints; the hand keeps what it holds

 private:
  BridgeNode(const Params& params, const Joints& joints, runtime::Bus& bus);
  void take_command(runtime::Time now, const Reading& arm);
  void step_hand(runtime::Time now);
  void publish_arm(runtime::Time now, const Reading& arm);
  void publish_status(runtime::Time now, const Reading& arm);

  Params params_;
  std::vector<std::string> joint_names_;
  CommandGate gate_;
  arm::GroupDriver driver_;
  std::unique_ptr<outside::RecordedHand> hand_driver_;
  modbus::HandSetpoint hand_setpoint_;
  modbus::HandReading hand_reading_;
  std::uint64_t steps_ = 0;
  runtime::Time status_due_{};
  v1::BridgeStatus status_message_;
  v1::ArmState arm_message_;
  runtime::Throttle refusals_{std::chrono::seconds(1)};

  runtime::Latest<v1::JointCommand> command_;
  runtime::Latest<v1::HandCommand> hand_command_;
  runtime::Out<v1::ArmState> arm_;
  runtime::Out<v1::HandState> hand_;
  runtime::Out<foxglove::JointStates> joints_;
  runtime::Out<v1::BridgeStatus> status_;
};

}  // namespace mimesis::hw::bridge
