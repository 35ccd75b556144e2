#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "common/error.h"
#include "tools/mimesis/log/sort.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {

void add_sort(CLI::App& verb, int& exit_code) {
  CLI::App* sort =
      verb.add_subcommand("sort", "Writes a log in the order of log time (like mcap sort)");
  struct Options {
    SortOptions sort;
    std::vector<std::string> inputs;
  };
  auto o = std::make_shared<Options>();
  add_input_output(*sort, o->inputs, o->sort.output);
  add_output_options(*sort, o->sort.output);
  add_size_option(*sort, "--memory", o->sort.memory, {std::size_t{1} << 16, std::size_t{1} << 40},
                  "Most unpacked bytes to hold (default 512MiB); what is further out of order is "
                  "sorted in files beside the output");
  sort->add_flag("--json", o->sort.json, "Print what was written as one JSON object");
  sort->footer(
      "Equal times stay in the order of the file. Every sum of the file is checked; exit code 1 if "
      "it is damaged.\nExample: mimesis log sort run.mcap -o sorted.mcap");
  sort->callback([o, &exit_code] {
    take_output(o->inputs, o->sort.output);
    if (o->inputs.size() != 1) throw ConfigError("expected one log to sort: merge joins several");
    o->sort.input = o->inputs.front();
    exit_code = log_sort(o->sort);
  });
}

}  // namespace mimesis::tool
