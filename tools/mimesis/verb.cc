#include "tools/mimesis/verb.h"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <exception>
#include <iostream>

#include "common/error.h"
#include "tools/mimesis/usage.h"

namespace mimesis::tool {

int run_verb(const std::string& verb, int argc, char** argv, void (*add)(CLI::App&, int&)) {
  CLI::App program("Starts, watches and records graphs of robot nodes.", "mimesis");
  program.set_version_flag("--version", "mimesis " MIMESIS_VERSION);
  program.require_subcommand(1);
  int exit_code = 0;
  add(program, exit_code);
  // CLI11 takes the arguments in reverse order.
  std::vector<std::string> arguments(std::make_reverse_iterator(argv + argc),
                                     std::make_reverse_iterator(argv + 1));
  arguments.push_back(verb);
  try {
    program.parse(std::move(arguments));
  } catch (const CLI::ParseError& e) {
    return report_usage(program, e);
  } catch (const ConfigError& e) {
    std::cerr << e.what() << '\n';
    return 2;
  } catch (const std::exception& e) {
    std::cerr << "mimesis: " << e.what() << '\n';
    return 1;
  }
  return exit_code;
}

}  // namespace mimesis::tool
