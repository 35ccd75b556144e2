#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"

namespace mimesis::runtime {

struct Ball {
  double radius_m = 0.1;
  std::string name = "ball";
  void visit(ParamVisitor& v) {
    v("radius_m", radius_m, 0.01, 1.0);
    v("name", name);
  }
};

struct Drive {
  double limit_rad_s = 2.0;
  bool enabled = true;
  void visit(ParamVisitor& v) {
    v("limit_rad_s", limit_rad_s, 0.0, 5.0);
    v("enabled", enabled);
  }
};

/// One parameter of every kind.
struct CrowdParams {
  double rate_hz = 50.0;
  double k_1_s = 0.5;
  int agents = 2;
  bool log = false;
  std::string bus = "embedded:arm";
  std::string graph = "ring";
  std::vector<double> gains = {1.0, 2.0, 3.0};
  std::vector<std::string> names = {"a"};
  Drive drive;
  std::vector<Ball> balls = {{}, {0.2, "second"}};

  void visit(ParamVisitor& v) {
    v("rate_hz", rate_hz, 1.0, 1000.0);
    v("k_1_s", k_1_s, 1e-3, 10.0);
    v("agents", agents, 2, 256);
    v("log", log);
    v("bus", bus);
    v("graph", graph, {"ring", "line", "all_to_all"});
    v("gains", gains, 0.0, 100.0, 3);
    v("names", names);
    v.group("drive", [&](ParamVisitor& g) { drive.visit(g); });
    list(v, "balls", balls);
  }
};

}  // namespace mimesis::runtime
