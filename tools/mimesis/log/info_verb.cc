#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "tools/mimesis/log/info.h"
#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_info(CLI::App& verb, int& exit_code) {
  CLI::App* info = verb.add_subcommand("info", "Topics, counts, times, sizes and losses of a log");
  struct Options {
    std::string file;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  info->add_option("FILE", options->file, "An MCAP file")->required();
  info->add_flag("--json", options->json, "One JSON object");
  info->footer("Example: mimesis log info run.mcap --json | jq '.topics[].topic'");
  info->callback([options, &exit_code] { exit_code = log_info(options->file, options->json); });
}

}  // namespace mimesis::tool
