#pragma once
#include <memory>
#include <optional>
#include <string>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "hw/sim/hand/hand.h"
#include "proto/bridge.pb.h"
#include "proto/world.pb.h"

namespace mimesis::hw::sim {

struct HandNodeParams {
  double rate_hz = 100.0;  ///< rate of steps [Hz]
  /// time of the first step within the period: after the bridge's [s]
  double offset_s = 0.0025;
  std::string address = "unix:hand";  ///< served: tcp:HOST:PORT, unix:NAME, rtu:DEVICE
  HandParams hand{};

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 10.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    v("address", address);
    v("closing_time_s", hand.closing_time_s, 0.1, 10.0);
    v("activation_time_s", hand.activation_time_s, 0.0, 10.0);
    v("mode_time_s", hand.mode_time_s, 0.0, 10.0);
  }
};

/// A simulated hand behind Modbus. Where its fingers meet the object it learns from the world.
class HandNode {
 public:
  using Params = HandNodeParams;
  HandNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  HandOutput exchange(const HandInput& input);

  runtime::Bus& bus_;
  HandPlant plant_;
  std::unique_ptr<HandServer> server_;  // null in a replay
  std::optional<runtime::Time> last_step_;
  runtime::Latest<v1::HandContact> contact_;
  runtime::Out<v1::HandState> hand_;
};

}  // namespace mimesis::hw::sim
