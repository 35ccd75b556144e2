#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "hw/cia402/axis.h"
#include "hw/sim/powercube/module.h"
#include "proto/bridge.pb.h"

namespace mimesis::hw::sim {

struct PowercubeParams {
  double rate_hz = 200.0;    ///< rate of steps: the robot's [Hz]
  double offset_s = 0.0025;  ///< time of the first step within the period: after the bridge's [s]
  std::string bus = "embedded:arm";  ///< address of the bus, see hw/can/bus.h
  std::string robot = "lwr4.yaml";   ///< model file: number of joints, home posture, limits
  double v_margin = 1.2;             ///< motor's largest speed relative to the model's v_max [1]
  double watchdog_s = 0.1;           ///< a module halts after this time without a refresh [s]
  bool homed = true;                 ///< the modules know their zeros at power-on
  std::vector<cia402::Axis> axes{};  ///< node_id: the module; empty: modules 1..n

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v("bus", bus);
    v.file("robot", robot, "arm");
    v("homed", homed);
    runtime::list(v, "axes", axes);
  }
  double robot_rate_hz() const;  ///< see run_node
};

/// The modules of a simulated arm on a CAN bus. Publishes where the joints truly are.
class PowercubeNode {
 public:
  using Params = PowercubeParams;
  PowercubeNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  std::vector<cia402::Axis> axes_;
  std::vector<Module> modules_;
  std::unique_ptr<can::Bus> bus_;
  std::vector<can::Frame> inbox_, outbox_;
  runtime::Out<v1::JointState> arm_;
};

}  // namespace mimesis::hw::sim
