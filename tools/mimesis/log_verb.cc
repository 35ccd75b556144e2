#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <memory>

#include "common/error.h"
#include "tools/mimesis/log_info.h"
#include "tools/mimesis/log_play.h"
#include "tools/mimesis/log_record.h"
#include "tools/mimesis/number_check.h"
#include "tools/mimesis/verbs.h"

namespace mimesis::tool {
namespace {

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

void add_play(CLI::App& verb, int& exit_code) {
  CLI::App* play = verb.add_subcommand("play", "Publishes the messages of a log again");
  struct Options {
    PlayOptions play;
    std::vector<std::string> topics;
    std::string regex, exclude;
  };
  auto o = std::make_shared<Options>();
  play->add_option("FILE", o->play.file, "An MCAP file")->required();
  play->add_option("--topic", o->topics, "Only this topic (repeatable)")->allow_extra_args(false);
  play->add_option("--regex", o->regex, "Only topics that match as a whole");
  play->add_option("--exclude", o->exclude, "Not those that match as a whole");
  play->add_option("--rate", o->play.rate, "Recorded seconds per second")
      ->check(CLI::Range(1e-3, 1e3))
      ->capture_default_str();
  CLI::Option* loop = play->add_option("--loop", o->play.loops, "So many times; 0: until stopped")
                          ->check(number_not_below_zero)
                          ->capture_default_str();
  play->add_option("--start", o->play.playback.start_s, "Skip so many recorded seconds")
      ->check(number_not_below_zero);
  play->add_option("--duration", o->play.playback.duration_s, "Play so many recorded seconds")
      ->check(number_not_below_zero);
  play->add_option("--name", o->play.name, "Name of the player in the graph")
      ->capture_default_str();
  CLI::Option* clock = play->add_flag("--clock", o->play.clock,
                                      "Drive the clock of a graph that runs on simulated time");
  CLI::Option* lockstep = play->add_flag("--lockstep", o->play.lockstep,
                                         "Step with a lock-step graph; stays until it is stopped");
  play->add_option("--step-rate", o->play.step_rate_hz, "Of the player in lock-step [Hz]")
      ->check(CLI::Range(1.0, 1e5))
      ->needs(lockstep)
      ->capture_default_str();
  lockstep->excludes(clock)->excludes(loop);
  play->add_flag("--json", o->play.json, "Print one JSON object at the end");
  play->footer(
      "Latched topics come first, with the last value before the start. clock/time is not played.\n"
      "Example: mimesis log play run.mcap --topic camera/image --rate 0.5");
  play->callback([o, &exit_code] {
    o->play.playback.topic = TopicFilter(o->topics, o->regex, o->exclude);
    exit_code = log_play(o->play);
  });
}

}  // namespace

void add_log(CLI::App& program, int& exit_code) {
  CLI::App* verb =
      program.add_subcommand("log", "Records, plays and describes message logs (MCAP)");
  verb->require_subcommand(1);
  add_record(*verb, exit_code);
  add_play(*verb, exit_code);
  add_info(*verb, exit_code);
}

}  // namespace mimesis::tool
