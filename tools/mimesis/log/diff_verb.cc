#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <memory>

#include "tools/mimesis/log/diff.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/number_check.h"

namespace mimesis::tool {

void add_diff(CLI::App& verb, int& exit_code) {
  CLI::App* diff = verb.add_subcommand("diff", "Compares two logs (bags) message by message");
  struct Options {
    std::string a, b;
    DiffOptions diff;
    TopicOptions topics;
    bool all_topics = false, json = false;
  };
  auto o = std::make_shared<Options>();
  diff->add_option("A", o->a, "An MCAP file")->required();
  diff->add_option("B", o->b, "Another one")->required();
  add_topic_options(*diff, o->topics);
  diff->add_flag("--all-topics", o->all_topics,
                 "Also */health, */log, */steps, */start and clock/time, which differ between "
                 "equal runs");
  diff->add_option("--tolerance", o->diff.tolerance,
                   "Largest difference of floating-point numbers that counts as equal")
      ->check(number_not_below_zero)
      ->capture_default_str();
  diff->add_option("--field-tolerance", o->diff.field_tolerances,
                   "TOPIC.FIELD=X: instead for one field, integers included (repeatable)")
      ->allow_extra_args(false);
  diff->add_option("--ignore", o->diff.ignore,
                   "TOPIC.FIELD with all below it; *.FIELD: of every topic (repeatable)")
      ->allow_extra_args(false);
  diff->add_flag("--times", o->diff.times, "Log and publish times must be equal, too");
  diff->add_flag("--json", o->json, "One JSON object");
  diff->footer(
      "Messages are matched by topic, publishing node and sequence number. NaN is equal to NaN.\n"
      "Exit code 0: equal, 1: different.\n"
      "Example: mimesis log diff yesterday.mcap today.mcap --tolerance 1e-9 "
      "--ignore '*.header.stamp_ns'");
  diff->callback([o, &exit_code] {
    const TopicFilter filter = filter_of(o->topics);
    o->diff.topic = [filter, all = o->all_topics](const std::string& topic) {
      const bool named = std::ranges::find(filter.topics(), topic) != filter.topics().end();
      return filter(topic) && (all || named || !is_runtime_topic(topic));
    };
    exit_code = log_diff(o->a, o->b, o->diff, o->json);
  });
}

}  // namespace mimesis::tool
