#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <exception>
#include <iostream>

#include "common/error.h"
#include "tools/mimesis/usage.h"
#include "tools/mimesis/verbs.h"

int main(int argc, char** argv) {
  CLI::App program("Starts, watches and records graphs of robot nodes.", "mimesis");
  program.set_version_flag("--version", "mimesis " MIMESIS_VERSION);
  program.require_subcommand(1);
  program.footer(
      "Exit codes: 0 done, 1 failed, 2 usage or configuration, 3 not found or timed out, 130 "
      "interrupted.\n"
      "Examples:\n"
      "  mimesis launch launch/imitation.yaml\n"
      "  mimesis topic echo planner/status --once");
  int exit_code = 0;
  mimesis::tool::add_launch(program, exit_code);
  mimesis::tool::add_topic(program, exit_code);
  mimesis::tool::add_node(program, exit_code);
  mimesis::tool::add_log(program, exit_code);
  mimesis::tool::add_crowd(program, exit_code);
  mimesis::tool::add_demix(program, exit_code);
  mimesis::tool::add_reproduce(program, exit_code);
#ifdef MIMESIS_HAS_WALK_TRIALS
  mimesis::tool::add_walk_trials(program, exit_code);
#endif
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return mimesis::tool::report_usage(program, e);
  } catch (const mimesis::ConfigError& e) {
    std::cerr << e.what() << '\n';
    return 2;
  } catch (const std::exception& e) {
    std::cerr << "mimesis: " << e.what() << '\n';
    return 1;
  }
  return exit_code;
}
