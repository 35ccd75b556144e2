#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>

#include "common/runtime/value_text.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/rewrite.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {
namespace {

constexpr double kLargestOffset_s = 1e9;

/// By input. @throws ConfigError
std::vector<std::int64_t> offsets_ns(const MergeOptions& options) {
  std::vector<std::int64_t> offsets(options.inputs.size(), 0);
  for (const std::string& text : options.offsets) {
    const auto [file, seconds] = parse_offset(text);
    const auto input = std::ranges::find(options.inputs, file);
    if (input == options.inputs.end()) {
      throw ConfigError(fmt::format("--offset: '{}' is not among the files to merge{}", file,
                                    runtime::did_you_mean(file, options.inputs)));
    }
    offsets[static_cast<std::size_t>(input - options.inputs.begin())] = std::llround(seconds * 1e9);
  }
  return offsets;
}

}  // namespace

std::pair<std::string, double> parse_offset(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals != std::string::npos && equals > 0) {
    const auto seconds = runtime::to_double(std::string_view(text).substr(equals + 1));
    if (seconds && std::abs(*seconds) <= kLargestOffset_s)
      return {text.substr(0, equals), *seconds};
  }
  throw ConfigError(fmt::format("--offset: expected FILE=SECONDS, found '{}'", text));
}

int log_merge(const MergeOptions& options) {
  const auto offsets = offsets_ns(options);
  const auto logs = opened(options.inputs);
  OutputOptions output = options.output;
  output.profile = common_profile(logs);
  NewLog out(output, options.inputs);
  LatchedRepeats repeats;
  Pass pass = each_message(
      "merge", logs, {},
      [&](const Item& item) { return repeats.repeated(item) ? log::Result{} : out.copy(item); },
      offsets);
  copy_attachments(logs, out, pass);
  copy_metadata(logs, out, pass, read_losses(logs));
  for (const std::string& schema : out.conflicts()) {
    std::cerr << fmt::format("{} is defined differently in the inputs: kept apart\n", schema);
  }
  return conclude(out, pass, options.json,
                  {{"conflicts", nlohmann::ordered_json(out.conflicts())}});
}

void add_merge(CLI::App& verb, int& exit_code) {
  CLI::App* merge = verb.add_subcommand(
      "merge", "Joins logs into one, in the order of log time (like mcap merge)");
  auto o = std::make_shared<MergeOptions>();
  merge->add_option("FILE", o->inputs, "MCAP files to read")->required();
  merge->add_option("--output,-o", o->output.path, "File to write")->required();
  merge
      ->add_option("--offset", o->offsets,
                   "FILE=SECONDS, added to the log and publish times of a file whose host had "
                   "another clock (repeatable)")
      ->allow_extra_args(false);
  add_output_options(*merge, o->output);
  merge->add_flag("--json", o->json, "Print what was written as one JSON object");
  merge->footer(
      "Channels of one topic, type and metadata become one. Latched values that parts of a split\n"
      "recording repeat are written once. Stamps inside of messages stay as they are.\n"
      "Examples:\n  mimesis log merge run_000.mcap run_001.mcap -o run.mcap\n"
      "  mimesis log merge robot.mcap vision.mcap -o both.mcap --offset vision.mcap=-0.012");
  on_run(*merge, exit_code, [o] { return log_merge(*o); });
}

}  // namespace mimesis::tool
