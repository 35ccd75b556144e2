#pragma once
#include <optional>
#include <string>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "hw/outside/recorded.h"
#include "hw/sim/udp/controller.h"
#include "proto/bridge.pb.h"

namespace mimesis::hw::sim {

struct UdpParams {
  double rate_hz = 200.0;    ///< rate of steps: the robot's [Hz]
  double offset_s = 0.0025;  ///< time of the first step within the period: after the bridge's [s]
  std::string address = "127.0.0.1:30200";  ///< where it is bound, HOST:PORT
  std::string robot = "lwr4.yaml";          ///< model file: joints, home posture, limits

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v("address", address);
    v.file("robot", robot, "arm");
  }
  double robot_rate_hz() const;  ///< see run_node
};

/// A simulated controller behind a UDP socket. Publishes where the joints truly are.
class UdpNode {
 public:
  using Params = UdpParams;
  UdpNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  outside::RecordedEndpoint endpoint_;
  std::optional<Controller> controller_;
  runtime::Out<v1::JointState> joints_;
};

}  // namespace mimesis::hw::sim
