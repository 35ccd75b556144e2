#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "nodes/crowd/external/external_agents.h"
#include "nodes/crowd/regions/far_crowd.h"
#include "nodes/crowd/regions/region_map.h"

namespace mimesis::crowd {

/// Which part of the plane is whose. All coordinators of a crowd have the same cuts.
struct RegionParams {
  int own = 1;                       ///< number of this coordinator, from 1
  std::vector<double> x_m{}, y_m{};  ///< cuts of the plane; none: one coordinator
  double margin_m = 0.5;             ///< who is so far beyond the border is handed over
  double sight_m = 6.0;              ///< others so near to one of ours are avoided
  double stale_s = 0.5;              ///< a coordinator not heard for so long is gone

  void visit(runtime::ParamVisitor& v);
  RegionMap map() const { return {x_m, y_m}; }
};

/// A walking robot on port `robot`.
struct RobotParams {
  int agent = -1;       ///< number of the external agent that it is; none: the port is not heard
  double step_s = 0.8;  ///< of one of its steps

  void visit(runtime::ParamVisitor& v);
};

struct CrowdParams {
  double rate_hz = 50.0;  ///< of steps, and of the simulation [Hz]
  double offset_s = 0.0;  ///< of the first step within the period [s]
  std::string scenario = "formation";
  std::vector<std::string> set{};  ///< "KEY=VALUE" over what the scenario's file says
  double until_s = 0.0;            ///< length of the run; 0: the scenario's [s]
  RegionParams regions;
  TrustSettings trust;  ///< of external agents; its stale_s is the scenario's
  RobotParams robot;
  int first_character = 0;  ///< external agent that is character 0 of the synthesizer [1]
  double ahead_s = 0.6;     ///< headings wished of external agents are those after so long [s]
  double scene_hz = 10.0;   ///< of the picture for viewers; 0: none [Hz]
  int threads = 1;          ///< [1]

  void visit(runtime::ParamVisitor& v);
  /// The scenario at this rate. @throws ConfigError
  Scenario read_scenario() const;
  FarSettings far() const;
};

}  // namespace mimesis::crowd
