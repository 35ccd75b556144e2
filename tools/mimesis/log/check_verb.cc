#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "tools/mimesis/log/check.h"
#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_check(CLI::App& verb, int& exit_code) {
  CLI::App* check = verb.add_subcommand(
      "check", "Looks for everything that can be wrong with logs (like mcap doctor)");
  struct Options {
    std::vector<std::string> files;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  check->add_option("FILE", options->files, "MCAP files: several are parts, in this order")
      ->required();
  check->add_flag("--json", options->json, "One JSON object");
  check->footer(
      "All sums, records, indexes; order of log times; gaps and repetitions of sequence numbers;\n"
      "schemas and the contents of all messages; summary and counts against the data. One line "
      "per\n"
      "finding: error, warning or info. Exit code 1 if there is an error.\n"
      "Example: mimesis log check run.mcap --json | jq '.files[].findings[]'");
  check->callback([options, &exit_code] { exit_code = log_check(options->files, options->json); });
}

}  // namespace mimesis::tool
