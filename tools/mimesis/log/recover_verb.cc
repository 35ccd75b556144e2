#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "common/error.h"
#include "tools/mimesis/log/recover.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {

void add_recover(CLI::App& verb, int& exit_code) {
  CLI::App* recover = verb.add_subcommand(
      "recover",
      "Writes all that can be read of a damaged log into a new one (like mcap recover, ros2 bag "
      "reindex)");
  struct Options {
    RecoverOptions recover;
    std::vector<std::string> inputs;
  };
  auto o = std::make_shared<Options>();
  add_input_output(*recover, o->inputs, o->recover.output);
  add_output_options(*recover, o->recover.output);
  recover->add_flag("--json", o->recover.json, "Print what is missing as one JSON object");
  recover->footer(
      "The output is read back and compared before it gets its name; the input is never changed.\n"
      "Exit code 0: nothing that was in the file is missing (a log that was not closed ends "
      "early,\n"
      "that is all); 1: the output is good, but something is missing: standard error says what.\n"
      "Logs of a killed recorder open without this.\n"
      "Example: mimesis log recover broken.mcap -o whole.mcap");
  recover->callback([o, &exit_code] {
    take_output(o->inputs, o->recover.output);
    if (o->inputs.size() != 1) throw ConfigError("expected one log to recover");
    o->recover.input = o->inputs.front();
    exit_code = log_recover(o->recover);
  });
}

}  // namespace mimesis::tool
