#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/parallel/team.h"
#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "nodes/crowd/crowd_guests.h"
#include "nodes/crowd/crowd_params.h"
#include "nodes/crowd/run/watch.h"
#include "proto/crowd.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/motion.pb.h"

namespace mimesis::crowd {

/// Runs the crowd of a scenario: ScenarioRun between messages. Run time is the clock's since the
/// first step: after a pause the run makes the steps that it missed, up to half a second of them in
/// one step of the node, and says how far it is behind.
class CrowdNode {
 public:
  using Params = CrowdParams;
  /// @throws ConfigError for a scenario that theory refuses
  CrowdNode(const Params& params, runtime::Bus& bus);
  void step(runtime::Time now);

 private:
  using Time = runtime::Time;
  /// Computing time of steps on this machine.
  struct StepTimes {
    double worst_s = 0.0, agent_steps = 0.0, sum_s = 0.0;
    int steps = 0;
    double mean_s() const { return steps > 0 ? sum_s / steps : 0.0; }
  };
  void take_styles();
  int steps_due(Time now);
  void judge_guests(Time now, Time state_time);
  void observe(Time now);
  void advance();
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
  Guests guests_;
  std::optional<parallel::Team> team_;
  Watch watch_;
  Closeness closeness_;
  std::vector<Closeness::Disc> discs_;
  std::vector<Observed> everybody_;

  bool ended_ = false;
  std::string trouble_, behind_;
  std::optional<Time> begin_;  // of the run
  long walked_ = 0;            // steps of the run
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
