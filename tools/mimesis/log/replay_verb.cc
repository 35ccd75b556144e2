#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/log/replay.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/number_check.h"

namespace mimesis::tool {
namespace {

constexpr const char* kAbout = "Runs recorded nodes again, step by step, and compares all they do";
constexpr const char* kFooter =
    "Each step gets exactly the messages, the time and the bytes from outside that the recorded "
    "one "
    "had.\n"
    "Not compared: NODE/health, NODE/log, NODE/steps, NODE/start. With a launch file the whole "
    "graph\n"
    "runs again (lock-step only), with the arguments of the recorded run.\n"
    "Exit codes: 0 equal, 1 different or not complete, 3 the node is not in the log or timed out.\n"
    "Examples:\n"
    "  mimesis log replay run.mcap\n"
    "  mimesis log replay planner run.mcap --repeat 100\n"
    "  mimesis log replay planner run.mcap --exec build-asan/bin/mimesis_planner --tolerance 1e-9\n"
    "  mimesis log replay launch/imitation.yaml run.mcap";

bool is_launch_file(const std::string& word) {
  return word.ends_with(".yaml") || word.ends_with(".yml");
}

bool is_log(const std::string& word) {
  std::error_code ignored;
  return word.ends_with(".mcap") || word.find('/') != std::string::npos ||
         std::filesystem::is_regular_file(word, ignored);
}

/// [NODE ...] LOG... or LAUNCH_FILE LOG...
void sort_words(const std::vector<std::string>& words, ReplayOptions& options) {
  for (const std::string& word : words) {
    if (is_launch_file(word)) {
      if (!options.launch.empty())
        throw ConfigError("mimesis log replay: one launch file, not two");
      options.launch = word;
    } else {
      (is_log(word) ? options.logs : options.nodes).push_back(word);
    }
  }
  if (options.logs.empty()) {
    throw ConfigError("mimesis log replay: which log? There is no file '" + words.back() + "'");
  }
  if (!options.launch.empty() && !(options.nodes.empty() && options.program.empty())) {
    throw ConfigError("mimesis log replay: a launch file runs all its nodes: no NODE, no --exec");
  }
  if (options.launch.empty() && !options.args.empty()) {
    throw ConfigError("mimesis log replay: --arg is for a launch file");
  }
}

}  // namespace

void add_replay(CLI::App& log, int& exit_code) {
  CLI::App* verb = log.add_subcommand("replay", kAbout);
  struct Options {
    ReplayOptions replay;
    std::vector<std::string> words;
    std::uint64_t keep_going = 0;  ///< 0: to the end
  };
  auto o = std::make_shared<Options>();
  verb->add_option("WORDS", o->words,
                   "Nodes (default: all that the log tells enough of) or a launch file, then logs")
      ->required()
      ->type_name("[NODE ...|LAUNCH_FILE] LOG ...");
  verb->add_option("--exec", o->replay.program,
                   "Program of the node, or a folder of programs: another build")
      ->type_name("PATH");
  verb->add_option("--set", o->replay.sets,
                   "Sets a parameter otherwise than recorded (repeatable); NODE.KEY=VALUE with a "
                   "launch file")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--arg", o->replay.args, "Argument of the launch file, otherwise than recorded")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false);
  verb->add_option("--tolerance", o->replay.tolerance,
                   "Floating-point fields may differ by X, absolute or relative")
      ->type_name("X")
      ->check(number_not_below_zero);
  verb->add_option("--tolerance-elsewhere", o->replay.tolerance_elsewhere,
                   "The same, but only if this machine does not compute as the one that recorded "
                   "(CPU, libm, compiler)")
      ->type_name("X")
      ->check(number_not_below_zero)
      ->excludes("--tolerance");
  verb->add_option("--timeout", o->replay.timeout_s,
                   "Give up when a step takes longer (with a launch file: when no message comes)")
      ->type_name("SECONDS")
      ->check(number_above_zero)
      ->capture_default_str();
  CLI::Option* keep_going =
      verb->add_flag("--keep-going{0}", o->keep_going,
                     "Do not stop at the first difference but after N (--keep-going=N)")
          ->type_name("N");
  verb->add_option("--repeat", o->replay.repeat, "Replay so many times: n of N are equal")
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000))
      ->capture_default_str();
  verb->add_flag("--json", o->replay.json, "One JSON object per node (tools/mimesis/README.md)");
  verb->footer(kFooter);
  verb->callback([o, keep_going, &exit_code] {
    if (keep_going->count() > 0) {
      o->replay.differences =
          o->keep_going > 0 ? o->keep_going : std::numeric_limits<std::uint64_t>::max();
    }
    sort_words(o->words, o->replay);
    exit_code = log_replay(o->replay);
  });
}

}  // namespace mimesis::tool
