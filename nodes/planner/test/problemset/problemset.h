#pragma once
#include <optional>
#include <string>
#include <vector>

#include "common/kin/arm.h"
#include "nodes/planner/collision.h"

namespace mimesis::planner {

struct Query {
  std::string kind;  ///< uniform, cross, task_low, task_high, task_any
  Eigen::VectorXd start;
  std::vector<Eigen::VectorXd> goals;
};

struct ProblemScene {
  std::string name;
  Obstacles obstacles;
  std::vector<Query> queries;
};

/// Scenes of one robot (lwr4p, rx90 or planar2) of ../shared/data/planner/problemset.json.
struct ProblemSet {
  kin::ArmModel arm;
  std::vector<ProblemScene> scenes;
};

/// Empty if the file is absent.
std::optional<ProblemSet> load_problem_set(const std::string& robot);

}  // namespace mimesis::planner
