#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include "tools/mimesis/launch/launch.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {

void add_launch(CLI::App& program, int& exit_code) {
  CLI::App* verb =
      program.add_subcommand("launch", "Starts the nodes of a launch file and watches them");
  auto options = std::make_shared<launch::Options>();
  verb->add_option("file", options->file, "Launch file (YAML, see launch/README.md)")->required();
  verb->add_flag("--check", options->check,
                 "Report all mistakes of the file with line and column; start nothing");
  verb->add_flag("--dry-run", options->dry_run,
                 "Print the commands in order of start; start nothing");
  verb->add_option("--arg", options->args, "Value of an argument the file declares")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--set", options->sets, "Parameter of a node, the last wins")
      ->type_name("NODE.KEY=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--graph", options->graph,
                   "Name of the graph (default: MIMESIS_GRAPH, or default)");
  verb->add_option("--name", options->name,
                   "Name of the run and its log folder (default: date and time)");
  verb->add_flag("--keep-running", options->keep_running,
                 "Runs until it is stopped, whatever `result:` of the file says");
  verb->add_flag("--json", options->json, "Machine-readable output (tools/mimesis/README.md)");
  verb->footer(
      "Examples:\n"
      "  mimesis launch launch/imitation.yaml --arg teacher=full,below,low\n"
      "  mimesis launch launch/imitation.yaml --set planner.rate_hz=100\n"
      "  mimesis launch launch/imitation.yaml --check");
  verb->callback([options, &exit_code] { exit_code = launch::launch(*options); });
}

}  // namespace mimesis::tool
