#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "tools/mimesis/log/info.h"
#include "tools/mimesis/log/subverbs.h"

namespace mimesis::tool {

void add_info(CLI::App& verb, int& exit_code) {
  CLI::App* info = verb.add_subcommand(
      "info", "Topics, counts, times, sizes and losses of logs (like ros2 bag info, mcap du)");
  struct Options {
    std::vector<std::string> files;
    bool sizes = false, json = false;
  };
  auto options = std::make_shared<Options>();
  info->add_option("FILE", options->files, "MCAP files: several are one log in parts")->required();
  info->add_flag("--sizes", options->sizes, "Bytes per topic: reads all messages");
  info->add_flag("--json", options->json, "One JSON object");
  info->footer(
      "Examples:\n  mimesis log info run.mcap --json | jq '.topics[].topic'\n"
      "  mimesis log info run_*.mcap --sizes");
  info->callback([options, &exit_code] {
    exit_code = log_info(options->files, options->sizes, options->json);
  });
}

}  // namespace mimesis::tool
