#pragma once
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/runtime/log.h"
#include "common/runtime/ports.h"
#include "nodes/crowd/crowd_params.h"
#include "nodes/crowd/external/path_filter.h"
#include "nodes/crowd/run/scenario_run.h"
#include "proto/crowd.pb.h"
#include "proto/motion.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::crowd {

/// Agents that other processes move: those on port `agents`, which say their ids; and those that
/// have the name of the node that moves them: characters of synthesizers ("NODE/0", "NODE/1", ..;
/// NODE is the first one too) and robots ("NODE" of the walker). Decides whom to trust, puts them
/// into the run, and publishes their commands. An agent is moved by one node until that is
/// forgotten.
class Guests {
 public:
  using Time = runtime::Time;
  /// @param run  outlives it
  /// @throws ConfigError
  Guests(const CrowdParams& params, runtime::Bus& bus, ScenarioRun& run);

  /// Reads the ports.
  void take(Time now);
  /// A change of trust, or what went wrong with it.
  struct Change {
    int group;
    std::string what, trouble;
  };
  /// Adds agents to the run, removes them, and sets their states at `state_time`, the time of the
  /// run.
  std::vector<Change> judge(Time now, Time state_time);
  /// Commands to walk as the rules would move them.
  void publish_commands(Time now);
  /// Tells characters the gait of their group when they come and when it changes.
  void publish_styles(Time now);
  void describe(v1::CrowdStatus& status, Time now) const;
  /// Of what is known of an agent that is there.
  double age_s(int number, Time now) const {
    return agents_.trust(number) == Trust::absent ? 0.0 : agents_.age_s(number, now);
  }

 private:
  /// An agent with a body: its states of the last moments, for its rates, and its steps.
  struct Body {
    struct State {
      Time stamp;
      AgentReport report;
    };
    int character = 0;         // of its node
    std::deque<State> states;  // the first is the newest that is old enough for rates
    PathFilter path;
    StepGain step;
    HeadingTrim heading;
    double asked_m = 0.0;
    std::optional<double> asked_rad{};
  };
  void take_agents(const v1::CrowdStates& states, Time now);
  void take_characters(const v1::MotionBatch& batch, Time now);
  void take_robot(const v1::WalkFeedback& robot, Time now);
  /// A character of a node, and the number of its external agent.
  struct Named {
    int character, agent;
  };
  const std::vector<Named>& named(const std::string& node, int characters);
  bool moves(const std::string& node, int number, Time now);
  double step_s(int number) const;
  void hear(int number, const AgentReport& report, Time stamp, Time now);
  void hear_body(int number, int character, AgentReport report, Time stamp, Time now,
                 std::optional<double> phase_rate_rad_s = std::nullopt);
  Change change_trust(const ExternalAgents::Change& change, Time state_time);
  v1::GaitCommand command_for(int number, const Crowd::Wish& wish);

  CrowdParams params_;
  ScenarioRun& run_;
  ExternalAgents agents_;
  /// Who moves an agent, and who else would.
  struct Author {
    std::string node, other{};
    Time other_time{};
  };
  std::map<std::string, std::vector<Named>> named_;  // by node
  std::vector<std::string> reasons_;  // of their trust; like the maps by number of the agent
  std::map<int, Author> authors_;
  std::map<int, Body> bodies_;
  std::map<int, int> styles_;  // gait last sent to a character
  v1::CrowdCommand command_message_;
  runtime::Throttle bad_{std::chrono::seconds(1)}, twice_{std::chrono::seconds(1)};

  runtime::Queue<v1::CrowdStates, 256> agents_in_;
  runtime::Queue<v1::MotionBatch, 64> characters_in_;
  runtime::Queue<v1::WalkFeedback, 64> robots_in_;
  runtime::Out<v1::CrowdCommand> command_;
  runtime::Out<v1::StyleWish> style_;
};

}  // namespace mimesis::crowd
