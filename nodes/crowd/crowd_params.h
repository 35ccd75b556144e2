#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "nodes/crowd/external/external_agents.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

struct CrowdParams {
  double rate_hz = 50.0;               ///< rate of steps, and of the simulation [Hz]
  double offset_s = 0.0;               ///< time of the first step within the period [s]
  std::string scenario = "formation";  ///< name in launch/crowd, or a file
  std::vector<std::string> set{};      ///< "KEY=VALUE" replaces a value of the scenario's file
  double until_s = 0.0;                ///< length of the run; 0: the scenario's [s]
  TrustSettings trust;                 ///< trust in external agents; its stale_s is the scenario's
  double ahead_s = 0.6;                ///< look-ahead of the headings wished of external agents [s]
  double scene_hz = 10.0;              ///< rate of the scene for viewers; 0: none [Hz]
  int threads = 1;                     ///< number of threads [1]

  void visit(runtime::ParamVisitor& v);
  /// The scenario at this rate. @throws ConfigError
  Scenario read_scenario() const;
  /// The scenario's stale_s holds for external agents. @throws ConfigError
  TrustSettings trust_in(const Scenario& read) const;
};

}  // namespace mimesis::crowd
