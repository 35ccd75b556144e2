// `mimesis plan verify`: a program without the planner.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_text.h"
#include "common/model/files.h"
#include "nodes/planner/verb/plan_file.h"
#include "nodes/planner/verb/verify_geometry.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;

struct VerifyOptions {
  std::string file, robot;
  bool json = false;
};

int verify(const VerifyOptions& o) {
  const PlanFile plan = load_plan(o.file);
  const std::string& robot = o.robot.empty() ? plan.robot : o.robot;
  const model::CoveredArm covered = model::load_covered_arm(robot, false);
  const kin::ArmModel& arm = covered.arm;
  PlanVerdict verdict;
  try {
    verdict = verify_plan(plan, arm);
  } catch (const ConfigError& e) {
    throw ConfigError(o.file + ": " + e.what());
  }
  std::vector<std::string> gaps = changed_inputs(plan, inputs_of(robot, covered));
  for (std::string& gap : geometry_gaps(covered)) gaps.push_back(std::move(gap));
  if (arm.balls.empty())
    gaps.emplace_back("the arm has neither parts nor balls: nothing is checked");
  for (const std::string& link : arm.unchecked)
    gaps.push_back(fmt::format("link {} has no known shape: nothing of it is checked", link));
  verdict.findings.insert(verdict.findings.begin(), gaps.begin(), gaps.end());
  const bool proven = verdict.findings.empty();
  const auto number = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
  if (o.json) {
    std::cout << json_text(Json{{"file", o.file},
                                {"proven", proven},
                                {"motions", plan.motions.size()},
                                {"instants", verdict.instants},
                                {"postures", verdict.postures},
                                {"nearest_m", number(verdict.nearest_m)},
                                {"nearest_stop_m", number(verdict.nearest_stop_m)},
                                {"findings", verdict.findings},
                                {"left_out", verdict.left_out}})
              << '\n';
    return proven ? 0 : 1;
  }
  for (const std::string& finding : verdict.findings) fmt::print("{}\n", finding);
  if (verdict.left_out > 0) fmt::print("and {} findings more\n", verdict.left_out);
  fmt::print(
      "{}: {} motions, {} instants with their stops; nearest {:.2f} mm, in stops {:.2f} mm\n",
      proven ? "proven" : "NOT proven", plan.motions.size(), verdict.instants,
      1e3 * verdict.nearest_m, 1e3 * verdict.nearest_stop_m);
  return proven ? 0 : 1;
}

}  // namespace

void add_plan(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("plan", "Plans a motion or a task of an arm");
  verb->require_subcommand(1);
  auto o = std::make_shared<VerifyOptions>();
  CLI::App* sub = verb->add_subcommand(
      "verify", "Proves a written plan and its stops again, without the planner");
  sub->add_option("FILE", o->file, "Plan that `mimesis plan -o FILE` wrote")->required();
  sub->add_option("--robot", o->robot, "Arm, instead of the one that the plan names");
  sub->add_flag("--json", o->json,
                "One object: file, proven, motions, instants, postures, nearest_m, nearest_stop_m, "
                "findings, left_out");
  sub->footer(
      "Exit codes: 0 proven, 1 not, 2 usage or a file that is wrong.\n"
      "Examples:\n  mimesis plan verify plan.yaml\n  mimesis plan verify plan.yaml --json");
  sub->callback([o, &exit_code] { exit_code = verify(*o); });
}

}  // namespace mimesis::tool
