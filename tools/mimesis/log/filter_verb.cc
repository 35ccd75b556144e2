#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <memory>

#include "tools/mimesis/log/filter.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {

void add_filter(CLI::App& verb, int& exit_code) {
  CLI::App* filter = verb.add_subcommand(
      "filter",
      "Writes a part of logs into a new one (like ros2 bag convert, mcap filter|compress|"
      "decompress)");
  auto o = std::make_shared<FilterOptions>();
  auto topics = std::make_shared<TopicOptions>();
  add_input_output(*filter, o->inputs, o->output);
  add_topic_options(*filter, *topics);
  filter->add_option("--node", o->nodes, "Only what this node published (repeatable)")
      ->allow_extra_args(false);
  filter->add_option("--inputs-of", o->inputs_of,
                     "What a replay of this node needs: the topics that it reads and writes by its "
                     "NODE/start, NODE/start and NODE/steps");
  add_time_options(*filter, o->range);
  filter->add_option("--duration", o->range.duration, "So many seconds from --start on");
  filter->add_flag("--latched,!--no-latched", o->latched,
                   "Begin with the last values of latched topics before --start (default)");
  filter
      ->add_option("--every", o->every,
                   "Keep every Nth message of each topic, or TOPIC=N (repeatable)")
      ->allow_extra_args(false);
  filter
      ->add_option("--max-rate", o->max_rate,
                   "Keep at most so many a second of each topic, or TOPIC=HZ (repeatable)")
      ->allow_extra_args(false);
  filter->add_flag("!--no-attachments", o->attachments, "Leave attachments out");
  filter->add_flag("!--no-metadata", o->metadata, "Leave metadata out");
  filter
      ->add_option("--note", o->notes, "Stores KEY=VALUE in the log: where it is from (repeatable)")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  add_output_options(*filter, o->output);
  filter->add_flag("--json", o->json, "Print what was written as one JSON object");
  filter->footer(
      "Thinning leaves latched topics alone unless they are named. Exit code 1 if an input is "
      "damaged.\n"
      "Examples:\n  mimesis log filter run.mcap images.mcap --topic camera/image --max-rate 5\n"
      "  mimesis log filter run.mcap -o part.mcap --start 12.5 --duration 3\n"
      "  mimesis log filter run.mcap -o planner.mcap --inputs-of planner\n"
      "  mimesis log filter run.mcap -o small.mcap --compression zstd --level 19   (compress)\n"
      "  mimesis log filter run.mcap -o plain.mcap --compression none   (decompress)");
  filter->callback([o, topics, &exit_code] {
    take_output(o->inputs, o->output);
    o->topics = topics->topics;
    o->regex = topics->regex;
    o->exclude = topics->exclude;
    exit_code = log_filter(*o);
  });
}

}  // namespace mimesis::tool
