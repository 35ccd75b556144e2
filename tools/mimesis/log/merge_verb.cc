#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "tools/mimesis/log/merge.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {

void add_merge(CLI::App& verb, int& exit_code) {
  CLI::App* merge = verb.add_subcommand(
      "merge", "Joins logs into one, in the order of log time (like mcap merge)");
  struct Options {
    MergeOptions merge;
    std::vector<std::string> offsets;
  };
  auto o = std::make_shared<Options>();
  merge->add_option("FILE", o->merge.inputs, "MCAP files to read")->required();
  merge->add_option("--output,-o", o->merge.output.path, "File to write")->required();
  merge
      ->add_option("--offset", o->offsets,
                   "FILE=SECONDS, added to the log and publish times of a file whose host had "
                   "another clock (repeatable)")
      ->allow_extra_args(false);
  add_output_options(*merge, o->merge.output);
  merge->add_flag("--json", o->merge.json, "Print what was written as one JSON object");
  merge->footer(
      "Channels of one topic, type and metadata become one. Latched values that parts of a split\n"
      "recording repeat are written once. Stamps inside of messages stay as they are.\n"
      "Examples:\n  mimesis log merge run_000.mcap run_001.mcap -o run.mcap\n"
      "  mimesis log merge robot.mcap vision.mcap -o both.mcap --offset vision.mcap=-0.012");
  merge->callback([o, &exit_code] {
    for (const std::string& text : o->offsets) o->merge.offsets_s.insert(parse_offset(text));
    exit_code = log_merge(o->merge);
  });
}

}  // namespace mimesis::tool
