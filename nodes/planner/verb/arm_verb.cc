// `mimesis plan arm`: the safety balls and convex parts of an arm, and how much more than its
// geometry they are.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/model/files.h"
#include "nodes/planner/verb/cover_text.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using Json = nlohmann::ordered_json;

struct ArmOptions {
  std::string robot;
  bool json = false, yaml = false;
};

Json json_of(const model::CoveredArm& covered) {
  Json report{{"arm", covered.arm.name},
              {"joints", covered.arm.dof()},
              {"balls", covered.arm.balls.size()},
              {"parts", covered.arm.parts.size()},
              {"links", Json::array()},
              {"always_touching", covered.always_touching},
              {"touching_at_home", touching_at_home(covered)},
              {"obstacle_groups", Json::array()},
              {"unchecked", covered.arm.unchecked}};
  for (const int group : covered.arm.env_groups)
    report["obstacle_groups"].push_back(covered.arm.groups[static_cast<std::size_t>(group)]);
  for (const model::CoveredLink& link : covered.links) {
    Json row{{"link", link.link},
             {"group", covered.arm.groups[static_cast<std::size_t>(link.group)]},
             {"fitted", link.fitted},
             {"parts", link.parts.size()}};
    if (link.over) {
      row["reach_m"] = link.over->reach_m;
      row["solid_m3"] = link.over->solid_m3;
      row["parts_m3"] = link.over->parts_m3;
      row["bare_m3"] = link.over->bare_m3;
    }
    report["links"].push_back(row);
  }
  return report;
}

void print_table(const model::CoveredArm& covered) {
  TextTable table({"link", "group", "parts", "reach out [mm]", "volume ratio", "bare [%]"});
  for (const model::CoveredLink& link : covered.links) {
    std::vector<std::string> row{
        link.link,
        covered.arm.groups[static_cast<std::size_t>(link.group)],
        fmt::format("{} {}", link.parts.size(), link.fitted ? "fitted" : "given"),
        "-",
        "-",
        "-"};
    if (link.over) {
      const robot::OverCoverage& over = *link.over;
      row[3] = fmt::format("{:.1f}", 1e3 * over.reach_m);
      if (over.solid_m3 > 0.0) {
        row[4] = fmt::format("{:.2f}", over.parts_m3 / over.solid_m3);
        row[5] = fmt::format("{:.2f}", 100.0 * over.bare_m3 / over.solid_m3);
      }
    }
    table.row(std::move(row));
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  fmt::print("{} parts, {} balls\n", covered.arm.parts.size(), covered.arm.balls.size());
  fmt::print("{}", touching_text(covered));
  const auto& checked = covered.arm.env_groups;
  for (std::size_t g = 0; g < covered.arm.groups.size(); ++g) {
    if (std::ranges::find(checked, static_cast<int>(g)) == checked.end())
      fmt::print("not among obstacle_groups, checked against no obstacle: {}\n",
                 covered.arm.groups[g]);
  }
  for (const std::string& link : covered.arm.unchecked)
    fmt::print("of no known shape, checked against nothing: {}\n", link);
}

int show(const ArmOptions& o) {
  const model::CoveredArm covered = model::load_covered_arm(o.robot);
  if (o.json) {
    fmt::print("{}\n", json_text(json_of(covered)));
  } else if (o.yaml) {
    fmt::print("{}", cover_text(covered));
  } else {
    print_table(covered);
  }
  return 0;
}

}  // namespace

void add_plan(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("plan", "Plans a motion or a task of an arm");
  verb->require_subcommand(1);
  auto o = std::make_shared<ArmOptions>();
  CLI::App* sub = verb->add_subcommand(
      "arm", "Shows an arm's balls and parts, and how far they reach out of its geometry");
  sub->add_option("ROBOT", o->robot, "Arm, a file as models/lwr4.yaml")->required();
  sub->add_flag(
      "--json", o->json,
      "One object: arm, joints, balls, parts, links [{link, group, fitted, parts, reach_m, "
      "solid_m3, parts_m3, bare_m3}], always_touching, touching_at_home, obstacle_groups, "
      "unchecked");
  sub->add_flag("--yaml", o->yaml,
                "Parts and checks as an arm's file gives them: no more fitting then");
  sub->footer(
      "Of links with collision geometry: how far a part reaches out of it at most, volume of the "
      "parts by that of the geometry, share of the geometry that is in no part (0 of fitted "
      "ones). A ball is a part of one point.\n"
      "Exit codes: 0 done, 2 usage or a file that is wrong.\n"
      "Examples:\n  mimesis plan arm lwr4.yaml");
  sub->callback([o, &exit_code] { exit_code = show(*o); });
}

}  // namespace mimesis::tool
