#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/parallel/team.h"
#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "nodes/crowd/crowd_guests.h"
#include "nodes/crowd/crowd_params.h"
#include "nodes/crowd/crowd_peers.h"
#include "nodes/crowd/run/watch.h"
#include "proto/crowd.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/motion.pb.h"

namespace mimesis::crowd {

/// Runs the crowd of a scenario, or one region of it: ScenarioRun between messages. Number 1 of the
/// coordinators looks after external agents, watches the whole and publishes the outcome.
class CrowdNode {
 public:
  using Params = CrowdParams;
  /// @throws ConfigError for a scenario that theory refuses, regions that do not fit
  CrowdNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  using Time = runtime::Time;
  /// Computing time of steps on this machine.
  struct StepTimes {
    double mean_s = 0.0, worst_s = 0.0, agent_steps = 0.0, sum_s = 0.0;
    std::uint64_t steps = 0;
    void add(double s, int agents);
  };
  bool first() const { return peers_.first(); }
  const FarCrowd& far() const { return peers_.far(); }

  void take_styles();
  void share(Time state_time);
  void judge_guests(Time now, Time state_time);
  void observe();
  void advance();
  void count_near();
  void say(const std::string& trouble);

  void publish_states(Time now);
  void publish_scene(Time now);
  void publish_certificate(Time now);
  void publish_status(Time now);
  void publish_outcome(Time now);

  Params params_;
  runtime::Bus& bus_;
  Time period_;
  ScenarioRun run_;
  Peers peers_;
  Guests guests_;
  std::optional<parallel::Team> team_;
  Watch watch_;
  Closeness closeness_;
  std::vector<Closeness::Disc> discs_;
  std::vector<Observed> everybody_;

  bool runs_ = false, ended_ = false;
  std::string reason_, trouble_;
  std::uint64_t steps_ = 0;
  Time status_due_{}, certificate_due_{}, scene_due_{};
  bool status_changed_ = true;
  StepTimes step_times_;

  v1::CrowdStates states_message_;
  runtime::Throttle bad_styles_{std::chrono::seconds(1)};

  runtime::Queue<v1::StyleWish, 32> styles_in_;
  runtime::Out<v1::CrowdStates> states_;
  runtime::Out<v1::CrowdCertificate> certificate_;
  runtime::Out<v1::CrowdStatus> status_;
  runtime::Out<v1::CrowdOutcome> outcome_;
  runtime::Out<v1::CrowdInfo> info_;
  runtime::Out<foxglove::SceneUpdate> scene_;
};

}  // namespace mimesis::crowd
