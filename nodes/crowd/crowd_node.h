#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/parallel/team.h"
#include "common/runtime/log.h"
#include "common/runtime/params.h"
#include "common/runtime/ports.h"
#include "nodes/crowd/crowd_messages_node.h"
#include "nodes/crowd/external/external_agents.h"
#include "nodes/crowd/external/path_filter.h"
#include "nodes/crowd/regions/far_crowd.h"
#include "nodes/crowd/run/watch.h"
#include "proto/crowd.pb.h"
#include "proto/foxglove/scene.pb.h"
#include "proto/motion.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::crowd {

/// Division of the plane among coordinators. All coordinators of a crowd have the same cuts.
struct RegionParams {
  int own = 1;                       ///< number of this coordinator, from 1
  std::vector<double> x_m{}, y_m{};  ///< cuts of the plane; none: one coordinator
  double margin_m = 0.5;             ///< an agent this far beyond the border is handed over
  double sight_m = 6.0;              ///< distance within which agents of others are avoided
  double stale_s = 0.5;              ///< a coordinator silent for this long is left out

  RegionMap map() const { return {x_m, y_m}; }
};

/// A walking robot on port `robot`.
struct RobotParams {
  int agent = -1;       ///< number of the robot's external agent; -1: the port is ignored
  double step_s = 0.8;  ///< duration of one of its steps
};

struct CrowdParams {
  double rate_hz = 50.0;               ///< rate of steps, and of the simulation [Hz]
  double offset_s = 0.0;               ///< time of the first step within the period [s]
  std::string scenario = "formation";  ///< name in launch/crowd, or a file
  std::vector<std::string> set{};      ///< "KEY=VALUE" replaces a value of the scenario's file
  double until_s = 0.0;                ///< length of the run; 0: the scenario's [s]
  RegionParams regions;
  TrustSettings trust;  ///< trust in external agents; its stale_s is the scenario's
  RobotParams robot;
  int first_character = 0;  ///< number of the external agent of the synthesizer's character 0 [1]
  double ahead_s = 0.6;     ///< look-ahead of the headings wished of external agents [s]
  double scene_hz = 10.0;   ///< rate of the scene for viewers; 0: none [Hz]
  int threads = 1;          ///< number of threads [1]

  void visit(runtime::ParamVisitor& v);
  /// The scenario at this rate. @throws ConfigError
  Scenario read_scenario() const;
  FarSettings far() const;
};

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
  struct Took {
    double mean_s = 0.0, worst_s = 0.0, agent_steps = 0.0, sum_s = 0.0;
    std::uint64_t steps = 0;
    void add(double s, int agents);
  };
  /// An external agent that is a body: its last state, rates are differences, and its steps.
  struct Body {
    AgentReport report;
    Time stamp{};
    PathFilter path;
    StepGain step;
    HeadingTrim heading;
    double asked_m = 0.0;
    std::optional<double> asked_rad{};
  };
  /// Last message of a coordinator, without its agents.
  struct Peer {
    std::uint32_t hears = 0;
    double time_s = 0.0;
    double least_gap_m = std::numeric_limits<double>::infinity();
    double least_distance_m = std::numeric_limits<double>::infinity();
    std::uint64_t collisions = 0;
  };

  bool first() const { return first_; }
  int coordinators() const { return far_settings_.coordinators; }

  void take_peers(Time now);
  void take_handovers(Time state_time);
  void take_agents(Time now);
  void take_characters(Time now);
  void take_robot(Time now);
  void take_styles();
  void hear_body(int external, AgentReport report, Time stamp, Time now,
                 std::optional<double> phase_rate_rad_s = std::nullopt);
  void hear_external(AgentId id, const AgentReport& report, Time stamp, Time now);
  const SpeedFunction& gait_of(AgentId id) const;
  v1::GaitCommand command_for(int external, const Crowd::Wish& wish);
  void judge_externals(Time now, Time state_time);
  void trust_changed(const ExternalAgents::Change& change, Time state_time);

  bool begins(Time now);
  void share(Time state_time);
  void observe();
  void advance();
  void hand_over(Time now);
  void count_near();
  void say(const std::string& trouble);

  void publish_states(Time now);
  void publish_commands(Time now);
  void publish_styles(Time now);
  void publish_scene(Time now);
  void publish_certificate(Time now);
  void publish_status(Time now);
  void publish_outcome(Time now);

  Params params_;
  runtime::Bus& bus_;
  Time period_;
  RegionMap map_;
  FarSettings far_settings_;
  ScenarioRun run_;
  FarCrowd far_;
  ExternalAgents externals_;
  std::optional<parallel::Team> team_;
  Watch watch_;
  Closeness closeness_;
  std::vector<Closeness::Disc> discs_;
  std::vector<Observed> everybody_;
  std::vector<Peer> peers_;
  std::map<int, Body> bodies_;  // by number of the external agent
  std::map<int, int> styles_;   // gait last sent to a character, by number of the external agent
  std::vector<std::string> external_reasons_;

  bool runs_ = false, ended_ = false;
  bool first_ = false;       // first of the coordinators that are present
  std::vector<bool> there_;  // by number
  std::string reason_, trouble_;
  std::uint64_t steps_ = 0, given_ = 0, taken_ = 0;
  Time status_due_{}, certificate_due_{}, scene_due_{};
  bool status_changed_ = true;
  Took took_;

  v1::CrowdStates states_message_;
  v1::CrowdCommand command_message_;
  runtime::Throttle bad_states_{std::chrono::seconds(1)}, bad_agents_{std::chrono::seconds(1)},
      bad_styles_{std::chrono::seconds(1)}, bad_handovers_{std::chrono::seconds(1)};

  runtime::Reliable<v1::CrowdStates> peers_in_;
  runtime::Reliable<v1::CrowdHandover> handovers_in_;
  runtime::Queue<v1::CrowdStates, 256> agents_in_;
  runtime::Latest<v1::MotionBatch> characters_in_;
  runtime::Latest<v1::WalkFeedback> robot_in_;
  runtime::Queue<v1::StyleWish, 32> styles_in_;
  runtime::Out<v1::CrowdStates> states_;
  runtime::Out<v1::CrowdHandover> handovers_;
  runtime::Out<v1::CrowdCommand> command_;
  runtime::Out<v1::StyleWish> style_;
  runtime::Out<v1::CrowdCertificate> certificate_;
  runtime::Out<v1::CrowdStatus> status_;
  runtime::Out<v1::CrowdOutcome> outcome_;
  runtime::Out<v1::CrowdInfo> info_;
  runtime::Out<foxglove::SceneUpdate> scene_;
};

}  // namespace mimesis::crowd
