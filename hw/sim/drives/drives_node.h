#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "hw/cia402/axis.h"
#include "hw/sim/cia402/drive.h"
#include "proto/bridge.pb.h"

namespace mimesis::hw::sim {

struct DrivesParams {
  double rate_hz = 200.0;  ///< rate of steps: the robot's [Hz]
  /// time of the first step within the period: after the bridge's [s]
  double offset_s = 0.0025;
  std::string bus = "embedded:arm";  ///< address of the bus, see hw/can/bus.h
  std::string robot = "lwr4.yaml";   ///< model file: number of joints, home posture, dynamics
  std::string machine{};  ///< the bridge's machine file instead of `robot`, `bus` and `axes`
  double v_margin = 1.2;  ///< motor's largest speed relative to the model's v_max [1]
  double a_margin = 2.0;  ///< motor's largest acceleration relative to the model's a_max [1]
  double bandwidth_rad_s = 150.0;  ///< bandwidth of the position loops [rad/s]
  double following_window_rad =
      0.05;  ///< larger following error for longer than following_time_s: fault [rad]
  double following_time_s = 0.05;          ///< time beyond following_window_rad until a fault [s]
  int fault_axis = 0;                      ///< joint 1..n that fails, 0: none [1]
  double fault_at_s = 0.0;                 ///< time of the fault after the first step [s]
  std::string fault_kind = "overcurrent";  ///< kind of fault: overcurrent, mute (no answers) or jam
  /// what all drives do as drives of other makers do: docs/hardware
  std::vector<std::string> habits{};
  std::vector<cia402::Axis> axes{};  ///< empty: nodes 1..n with defaults

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v("bus", bus);
    v.file("robot", robot, "arm");
    v.file("machine", machine, "machine");
    v("fault_axis", fault_axis, 0, 126);
    v("fault_at_s", fault_at_s, 0.0, 1e6);
    v("fault_kind", fault_kind, {"overcurrent", "mute", "jam"});
    v("habits", habits);
    runtime::list(v, "axes", axes);
  }
  double robot_rate_hz() const;  ///< see run_node
};

/// The drives of a simulated arm on one CAN bus, or those of a machine file. Publishes where the
/// joints truly are.
class DrivesNode {
 public:
  using Params = DrivesParams;
  DrivesNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);
  /// No joint moves and no drive is enabled: the end of the simulation shows how the arm stopped.
  bool at_rest() const;

 private:
  void make_trouble(runtime::Time now);
  Drive& drive(int joint);

  Params params_;
  std::vector<std::unique_ptr<Rack>> racks_;  // one a bus
  std::optional<runtime::Time> trouble_at_;
  bool troubled_ = false;
  runtime::Out<v1::JointState> arm_;
};

}  // namespace mimesis::hw::sim
