#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "hw/sim/base/wheeled_base.h"
#include "proto/crowd.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/motion.pb.h"

namespace mimesis::hw::sim {

struct BasePlace {
  double x_m = 0.0, y_m = 0.0, heading_rad = 0.0;
  void visit(runtime::ParamVisitor& v) {
    v("x_m", x_m, -1e4, 1e4);
    v("y_m", y_m, -1e4, 1e4);
    v("heading_rad", heading_rad, -6.3, 6.3);
  }
};

struct SimBaseParams {
  double rate_hz = 50.0;           ///< rate of steps [Hz]
  double offset_s = 0.0;           ///< time of the first step within the period [s]
  std::vector<BasePlace> bases{};  ///< where they stand at the start
  BaseLimits limits{};
  double stale_s = 0.5;  ///< stands without a command for so long [s]

  void visit(runtime::ParamVisitor& v) {
    v("rate_hz", rate_hz, 1.0, 1000.0);
    v("offset_s", offset_s, 0.0, 1.0);
    runtime::list(v, "bases", bases);
    v.group("limits", [&](runtime::ParamVisitor& g) {
      g("v_max_m_s", limits.v_max_m_s, 0.01, 10.0);
      g("turn_max_rad_s", limits.turn_max_rad_s, 0.01, 20.0);
      g("a_max_m_s2", limits.a_max_m_s2, 0.01, 20.0);
      g("turn_a_max_rad_s2", limits.turn_a_max_rad_s2, 0.01, 100.0);
      g("turn_gain_1_s", limits.turn_gain_1_s, 0.01, 20.0);
    });
    v("stale_s", stale_s, 0.01, 60.0);
  }
};

/// Simulated wheeled bases that take part in a crowd: base k of the node N is the agent `N/k` of
/// the crowd's scenario.
class SimBaseNode {
 public:
  using Params = SimBaseParams;
  SimBaseNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  void read_info();
  void publish(runtime::Time now);

  Params params_;
  std::string name_;
  std::vector<WheeledBase> bases_;
  std::vector<std::uint64_t> ids_;  // in the crowd; 0: none
  std::vector<std::optional<BaseWish>> wishes_;
  std::optional<runtime::Time> told_, last_;
  runtime::Latest<v1::CrowdCommand> command_;
  runtime::Latest<v1::CrowdInfo> info_;
  runtime::Out<v1::CrowdStates> states_;
  runtime::Out<foxglove::SceneUpdate> entities_;
};

}  // namespace mimesis::hw::sim
