#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/model/files.h"
#include "common/motion/mocap/trials.h"
#include "nodes/synthesizer/robot/robot_trials.h"
#include "nodes/synthesizer/sequence/drawer_files.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

using namespace synthesizer;

struct Options {
  std::string out, robot;
  int seed = 1;
  bool json = false;
};

/// The trials that a synthesizer with this seed generates for itself.
DrawerData generated(const Options& o) {
  if (o.robot.empty()) {
    GeneratorSettings settings;
    settings.seed = static_cast<std::uint64_t>(o.seed);
    return generate_drawer_data(mocap::standard_body(), Drawer{}, settings);
  }
  const robot::Biped biped = model::load_biped(o.robot);
  RobotTrialSettings settings = robot_trial_settings(biped);
  settings.seed = static_cast<std::uint64_t>(o.seed);
  settings.cycle_s = 2.0 * biped.step_s;
  return generate_robot_data(biped, settings);
}

int run(const Options& o) {
  std::error_code refused;
  std::filesystem::create_directories(o.out, refused);  // writing says what is wrong
  const auto sets = split_actions(generated(o));
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  for (std::size_t a = 0; a < kActions; ++a) {
    files.push_back((std::filesystem::path(o.out) / kActionFiles[a]).string());
    mocap::write_trials(sets[a], files.back());
  }
  const mocap::Trials& set = sets[0];
  if (o.json) {
    const nlohmann::ordered_json report{{"files", files},
                                        {"trials", set.trials.size()},
                                        {"rows", set.rows.size()},
                                        {"samples", set.samples.cols()}};
    std::cout << report.dump() << '\n';
    return 0;
  }
  for (const auto& file : files) {
    std::cout << fmt::format("{}: {} trials of {} rows, {} samples\n", file.get<std::string>(),
                             set.trials.size(), set.rows.size(), set.samples.cols());
  }
  return 0;
}

}  // namespace

void add_drawer_trials(CLI::App& program, int& exit_code) {
  auto o = std::make_shared<Options>();
  CLI::App* verb = program.add_subcommand("drawer-trials",
                                          "Writes generated trials of the drawer task as files");
  verb->add_option("DIR", o->out, "Folder for normal_step.csv, reaching_step.csv, standing.csv")
      ->required();
  verb->add_option("--robot", o->robot,
                   "Trials of this robot, described as in models/biped.yaml; else of a figure")
      ->type_name("YAML");
  verb->add_option("--seed", o->seed, "As the synthesizer's drawer_seed")
      ->check(CLI::Range(0, 1'000'000'000))
      ->capture_default_str();
  verb->add_flag("--json", o->json, "Print one JSON object");
  verb->footer(
      "The synthesizer learns from such a folder with drawer_trials: DIR. Recorded trials have "
      "the\n"
      "same form (docs/synthesizer.md).\n"
      "Exit codes: 0 done, 2 usage, or a file that cannot be used.\nExamples:\n"
      "  mimesis drawer-trials /tmp/figure\n"
      "  mimesis drawer-trials /tmp/biped --robot models/biped.yaml --seed 3\n"
      "  mimesis demix /tmp/figure/standing.csv --tied -k 4 -o standing.motion.json");
  verb->callback([o, &exit_code] { exit_code = run(*o); });
}

}  // namespace mimesis::tool
