#include "nodes/planner/test/problemset/problemset.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/shared_data.h"

namespace mimesis::planner {
namespace {

using Json = nlohmann::json;

Eigen::VectorXd vector(const Json& json) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(json.size()));
  for (std::size_t i = 0; i < json.size(); ++i)
    v[static_cast<Eigen::Index>(i)] = json[i].get<double>();
  return v;
}

kin::ArmModel arm_of(const Json& json) {
  kin::ArmModel arm;
  arm.name = json["name"];
  const bool modified = json["convention"] == "modified";
  for (const auto& dh : json["dh"])
    arm.links.push_back({dh["a"], dh["alpha"], dh["d"], dh["off"], modified});
  arm.q_min = vector(json["lo"]);
  arm.q_max = vector(json["hi"]);
  arm.v_max = Eigen::VectorXd::Constant(arm.dof(), 2.0);
  arm.a_max = Eigen::VectorXd::Constant(arm.dof(), 6.0);
  arm.home = Eigen::VectorXd::Zero(arm.dof());
  arm.X_WB.translation() = vector(json["base"]);
  arm.X_LE.translation() = vector(json["ee"]["c"]);
  const auto group = [&](const std::string& name) {
    const auto found = std::find(arm.groups.begin(), arm.groups.end(), name);
    if (found != arm.groups.end()) return static_cast<int>(found - arm.groups.begin());
    arm.groups.push_back(name);
    return static_cast<int>(arm.groups.size()) - 1;
  };
  for (const auto& ball : json["balls"]) {
    arm.balls.push_back({ball["frame"], group(ball["group"]), vector(ball["c"]), ball["r"]});
  }
  for (const auto& pair : json["self_groups"])
    arm.self_pairs.emplace_back(group(pair[0]), group(pair[1]));
  for (const auto& name : json["env_groups"]) arm.env_groups.push_back(group(name));
  return arm;
}

ProblemScene scene_of(const Json& json) {
  ProblemScene scene;
  scene.name = json["name"];
  for (const auto& s : json["spheres"]) {
    scene.obstacles.balls.push_back({vector(s).head<3>(), s[3].get<double>()});
  }
  for (const auto& b : json["boxes"])
    scene.obstacles.boxes.push_back({vector(b["c"]), vector(b["h"]), ""});
  for (const auto& q : json["queries"]) {
    Query query{q["kind"], vector(q["start"]), {}};
    for (const auto& goal : q["goals"]) query.goals.push_back(vector(goal));
    scene.queries.push_back(std::move(query));
  }
  return scene;
}

}  // namespace

std::optional<ProblemSet> load_problem_set(const std::string& robot) {
  std::ifstream file(shared_data("data/planner/problemset.json"));
  if (!file) return std::nullopt;
  const Json json = Json::parse(file);
  ProblemSet set;
  for (const auto& r : json["robots"]) {
    if (r["name"] == robot) set.arm = arm_of(r);
  }
  for (const auto& scene : json["scenes"]) {
    if (scene["robot"] == robot) set.scenes.push_back(scene_of(scene));
  }
  return set;
}

}  // namespace mimesis::planner
