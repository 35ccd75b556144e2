// `mimesis plan roadmap`: the part of a roadmap that belongs to the arm, stored.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/model/files.h"
#include "nodes/planner/roadmap_file.h"
#include "tools/mimesis/number_check.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

struct RoadmapOptions {
  std::string robot, out;
  planner::RoadmapSettings settings;
  double margin_m = 0.002;
  bool json = false;
};

int store_roadmap(const RoadmapOptions& o) {
  const kin::ArmModel arm = model::load_arm(o.robot);
  const planner::Roadmap roadmap = planner::arm_roadmap(arm, o.settings, o.margin_m);
  save_roadmap(roadmap, arm, o.out);
  std::size_t links = 0;
  for (std::size_t i = 0; i < roadmap.links().size(); ++i) links += roadmap.links()[i].size();
  if (o.json) {
    fmt::print(
        "{}\n",
        nlohmann::ordered_json{{"file", o.out}, {"nodes", roadmap.size()}, {"links", links / 2}}
            .dump());
  } else {
    fmt::print("{}: {} nodes, {} links\n", o.out, roadmap.size(), links / 2);
  }
  return 0;
}

}  // namespace

void add_plan(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("plan", "Plans a motion or a task of an arm");
  verb->require_subcommand(1);
  auto o = std::make_shared<RoadmapOptions>();
  CLI::App* sub =
      verb->add_subcommand("roadmap", "Stores the part of a roadmap that belongs to the arm alone");
  sub->add_option("ROBOT", o->robot, "Arm, a file as models/lwr4.yaml")->required();
  sub->add_option("-o,--out", o->out, "File to write")->required()->type_name("FILE");
  sub->add_option("--nodes", o->settings.nodes, "Number of nodes [2500]")
      ->check(CLI::Range(100, 20000));
  sub->add_option("--margin-m", o->margin_m, "Least distance of the arm to itself [0.002]")
      ->check(number_not_below_zero);
  sub->add_option("--seed", o->settings.seed, "Another one gives other nodes [1]");
  sub->add_flag("--json", o->json, "One object: file, nodes, links");
  sub->footer(
      "The planner reads it (parameter `roadmap`), and so does `mimesis plan --roadmap`; both "
      "refuse "
      "it once the arm's file has changed.\n"
      "Exit codes: 0 done, 2 usage or a file that is wrong.\n"
      "Examples:\n  mimesis plan roadmap lwr4.yaml -o lwr4.roadmap");
  sub->callback([o, &exit_code] { exit_code = store_roadmap(*o); });
}

}  // namespace mimesis::tool
