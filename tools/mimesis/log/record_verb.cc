// The program mimesis-log-record: `mimesis log record` alone, for launches that need no other verb.
#include <CLI/CLI.hpp>

#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {

void add_log(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("log");
  verb->require_subcommand(1);
  add_record(*verb, exit_code);
}

}  // namespace mimesis::tool
