#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "nodes/crowd/external/external_agents.h"
#include "nodes/crowd/regions/far_crowd.h"
#include "nodes/crowd/scenario/scenario.h"

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
  /// @throws ConfigError for a region that the cuts do not make
  FarSettings far() const;
  /// The scenario's stale_s holds for external agents. @throws ConfigError
  TrustSettings trust_in(const Scenario& read) const;
};

}  // namespace mimesis::crowd
