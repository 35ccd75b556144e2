#pragma once
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/runtime/bus.h"
#include "common/runtime/params.h"
#include "hw/actuators.h"
#include "hw/joints/joints.h"
#include "hw/outside/frame_log.h"

namespace mimesis::hw::bridge {

struct BridgeParams {
  double rate_hz = 200.0;            ///< rate of SYNC and of steps: the robot's [Hz]
  double offset_s = 0.0;             ///< time of the first step within the period [s]
  std::string robot = "lwr4.yaml";   ///< model file: joints, their limits, rate
  std::string machine{};             ///< machine file instead of `robot`, `buses` and `axes`
  std::string can = "embedded:arm";  ///< bus of the drives, see hw/can/bus.h
  std::vector<BusShare> buses{};     ///< several buses instead of `can`
  std::string controller{};          ///< HOST:PORT of the joints' controller, of `drives: udp`
  std::string hand = "unix:hand";    ///< tcp:HOST:PORT, unix:NAME, rtu:DEVICE, or empty
  /// which kind of hand it is: a file of models/hands, see docs/hardware
  std::string hand_profile = "hands/robotiq_3f.yaml";
  /// what the joints do if the hand fails: go_on with the stream, stop as by an emergency stop
  std::string on_hand_fault = "go_on";
  bool readonly = false;  ///< listens to the drives and sends nothing; no hand
  /// what lets a stream move the joints: service bridge/enable, or auto: the stream itself
  std::string enable = "service";
  std::string stop_input{};    ///< emergency stop at a Modbus server: tcp:HOST:PORT, rtu:DEVICE
  int stop_input_unit = 1;     ///< its unit [1]
  int stop_input_address = 0;  ///< discrete input that is 1 while the circuit is closed [1]
  bool log_frames = false;     ///< publishes all frames of the buses: output `can`
  double silence_s = 0.1;      ///< the stream ends after this time without a command [s]
  /// reaction to silence: quick_stop, hold; auto: hold if the robot walks
  std::string on_silence = "auto";
  /// largest distance of a stream's first command from the actual posture [rad]
  double start_tolerance_rad = 0.02;
  double jump_rad = 0.1;              ///< largest jump within a stream beyond v_max [rad]
  double boot_timeout_s = 2.0;        ///< time until missing drives are reported [s]
  double transition_timeout_s = 0.5;  ///< time limit of a change of a drive's state [s]
  /// a silent bus is lost after this time [s]; 0: 1.5 cycles on SocketCAN and in lock-step, 0.1 s
  /// on a bus of this machine, whose drives are processes that may have to wait
  double feedback_timeout_s = 0.0;
  /// a drive is lost that lets so many pass, or one more of the last 20, while others answer [1]
  int missed_syncs = 2;
  double following_window_rad = 0.0;  ///< largest following error, 6065h; 0: the drives' own [rad]
  double following_time_s = 0.0;      ///< time beyond it until a fault, 6066h; 0: their own [s]
  /// largest distance of a joint from its set-point, beyond what its speed explains; 0: 0.1 rad of
  /// an arm, any of a robot that walks, whose joints the ground pushes [rad]
  double tracking_window_rad = 0.0;
  std::vector<cia402::Axis> axes{};  ///< drives of the joints; empty: nodes 1..n with defaults

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v.file("robot", robot, "arm or biped");
    v.file("machine", machine, "machine");
    v("can", can);
    runtime::list(v, "buses", buses);
    v("controller", controller);
    v("hand", hand);
    v.file("hand_profile", hand_profile, "hand");
    v("on_hand_fault", on_hand_fault, {"go_on", "stop"});
    v("readonly", readonly);
    v("enable", enable, {"service", "auto"});
    v("stop_input", stop_input);
    v("stop_input_unit", stop_input_unit, 1, 247);
    v("stop_input_address", stop_input_address, 0, 65535);
    v("log_frames", log_frames);
    v("silence_s", silence_s, 0.01, 1.0);
    v("on_silence", on_silence, {"auto", "quick_stop", "hold"});
    v("start_tolerance_rad", start_tolerance_rad, 0.001, 0.2);
    v("jump_rad", jump_rad, 0.001, 1.0);
    v("boot_timeout_s", boot_timeout_s, 0.1, 60.0);
    v("transition_timeout_s", transition_timeout_s, 0.05, 10.0);
    v("feedback_timeout_s", feedback_timeout_s, 0.0, 1.0);
    v("missed_syncs", missed_syncs, 1, 19);
    v("following_window_rad", following_window_rad, 0.0, 3.0);
    v("following_time_s", following_time_s, 0.0, 10.0);
    v("tracking_window_rad", tracking_window_rad, 0.0, 3.0);
    runtime::list(v, "axes", axes);
  }
  double robot_rate_hz() const;  ///< see run_node
};

/// The robot's joints; what the machine file says, if there is one, goes into `params`.
/// @throws ConfigError as load_machine, or if `buses` or `axes` are given beside it
Joints take_machine(BridgeParams& params);

/// Settings that actuators are made from.
struct ActuatorsRequest {
  const BridgeParams& params;
  const Joints& joints;  ///< joints of the robot's file: order, limits, home posture
  bool stays_powered;    ///< a stop leaves the joints powered, because the robot would fall
  runtime::Bus& graph;   ///< talk to devices through its outside(), or a log cannot be replayed
  outside::FrameLog* frames = nullptr;  ///< takes the frames of all buses, if anybody asked for it
};

/// Returns actuators that respect `joints.limits` (SetpointLimiter). @throws ConfigError
using MakeActuators = std::function<std::unique_ptr<Actuators>(const ActuatorsRequest&)>;

/// Makes `kind` known to nodes constructed later: a robot with `drives: kind` in its file gets the
/// result of `make`. To be called by main() before run_node(), on one thread. Known from the start:
/// "cia402" (CANopen drives on the buses of the parameters), "powercube" (modules on one bus) and
/// "udp" (a controller that takes datagrams, hw/udp).
void add_actuators(const std::string& kind, MakeActuators make);

/// The actuators of `request.joints.drives`. @throws ConfigError that lists the known kinds
std::unique_ptr<Actuators> make_actuators(const ActuatorsRequest& request);

}  // namespace mimesis::hw::bridge
