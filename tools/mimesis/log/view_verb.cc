#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/log/view.h"

namespace mimesis::tool {

void add_view(CLI::App& verb, int& exit_code) {
  CLI::App* view = verb.add_subcommand(
      "view", "Writes a log for viewers: robot, fields, roadmap in 3-D beside the messages");
  auto o = std::make_shared<ViewOptions>();
  add_input_output(*view, o->inputs, o->output);
  view->add_flag("--robot", o->layers.robot, "Arm and hand, where their states say they are");
  view->add_flag("--fields", o->layers.fields, "Activity of the neural fields, on a board");
  view->add_flag("--roadmap", o->layers.roadmap,
                 "The planner's roadmap, and the way of the hand in its motions");
  view->add_flag("--table", o->layers.table, "The table as the planner knows it");
  view->add_flag("--all", o->layers.all, "All of these that the log has the topics for");
  add_output_options(*view, o->output);
  view->add_flag("--json", o->json, "Print what was written as one JSON object");
  view->footer(
      "For Foxglove, Lichtblick and Rerun: see docs/viewers.md. Exit code 3 if what is asked for "
      "has no topic.\n"
      "Example: mimesis log view run.mcap run-view.mcap --all");
  view->callback([o, &exit_code] {
    take_output(o->inputs, o->output);
    exit_code = log_view(*o);
  });
}

}  // namespace mimesis::tool
