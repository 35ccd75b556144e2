#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <memory>

#include "common/error.h"
#include "tools/mimesis/log/record.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/number_check.h"

namespace mimesis::tool {

void add_record(CLI::App& verb, int& exit_code) {
  CLI::App* record =
      verb.add_subcommand("record", "Records topics of the graph until it is stopped");
  struct Options {
    std::vector<std::string> topics, attach;
    std::string regex, exclude, output, compression = "zstd";
    bool all = false, json = false;
    double duration_s = 0.0;
  };
  auto o = std::make_shared<Options>();
  record->add_flag("--all", o->all, "All topics");
  record->add_option("--topic", o->topics, "This topic (repeatable)")->allow_extra_args(false);
  record->add_option("--regex", o->regex, "Topics that match as a whole");
  record->add_option("--exclude", o->exclude, "Not those that match as a whole");
  record->add_option("--output,-o", o->output, "File to write; replaced if it exists")->required();
  record->add_option("--compression", o->compression, "Of chunks")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
  record->add_option("--duration", o->duration_s, "Stop after so many seconds of wall time")
      ->check(number_above_zero);
  record->add_option("--attach", o->attach, "Store this file in the log (repeatable): launch files")
      ->allow_extra_args(false);
  record->add_flag("--json", o->json, "Print the counts as one JSON object at the end");
  record->footer(
      "SIGINT, SIGTERM and SIGHUP close the log; after kill -9 it opens, too, less the last 100 "
      "ms.\n"
      "Exit code 1 if a message was lost or could not be written.\n"
      "Example: mimesis log record --all --exclude '.*/health' -o run.mcap");
  record->callback([o, &exit_code] {
    if (!o->all && o->topics.empty() && o->regex.empty()) {
      throw ConfigError("mimesis log record: say what: --all, --topic NAME or --regex RE");
    }
    if (o->all && !(o->topics.empty() && o->regex.empty())) {
      throw ConfigError(
          "mimesis log record: --all leaves nothing for --topic and --regex to choose");
    }
    exit_code = log_record({.filter = TopicFilter(o->topics, o->regex, o->exclude),
                            .output = o->output,
                            .compression = *log::parse_compression(o->compression),
                            .duration_s = o->duration_s,
                            .attach = o->attach,
                            .json = o->json});
  });
}

}  // namespace mimesis::tool
