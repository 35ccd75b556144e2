#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <memory>

#include "tools/mimesis/log/cat.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/number_check.h"

namespace mimesis::tool {

void add_cat(CLI::App& verb, int& exit_code) {
  CLI::App* cat = verb.add_subcommand(
      "cat", "Prints the messages of logs as JSON, one per line (like mcap cat --json)");
  struct Options {
    CatOptions cat;
    TopicOptions topics;
    std::string bytes = "length";
    bool json = true;
  };
  auto o = std::make_shared<Options>();
  cat->add_option("FILE", o->cat.files, "MCAP files: several are one, in the order of log time")
      ->required();
  add_topic_options(*cat, o->topics);
  add_time_options(*cat, o->cat.range);
  cat->add_option("--field", o->cat.fields,
                  "Only this field, such as header.seq or blobs.0.u_px (repeatable)")
      ->allow_extra_args(false);
  cat->add_option("--bytes", o->bytes, "How fields of type bytes look")
      ->check(CLI::IsMember({"length", "base64", "hex"}))
      ->capture_default_str();
  cat->add_option("--limit", o->cat.limit, "So many messages, then end")->check(number_above_zero);
  CLI::Option* attachment = cat->add_option("--attachment", o->cat.attachment,
                                            "Instead: this attachment (like mcap get attachment)");
  cat->add_option("--metadata", o->cat.metadata,
                  "Instead: this metadata record (like mcap get metadata)")
      ->excludes(attachment);
  cat->add_flag("--json", o->json, "JSON is what it prints anyway");
  cat->footer(
      "Examples:\n  mimesis log cat run.mcap --topic planner/status --limit 10 | jq .message\n"
      "  mimesis log cat run.mcap --topic bridge/arm --start 12.5 --end 13 --field position_rad\n"
      "  mimesis log cat run.mcap --attachment imitation.yaml > imitation.yaml");
  cat->callback([o, &exit_code] {
    o->cat.filter = filter_of(o->topics);
    o->cat.bytes = o->bytes == "hex"      ? BytesText::hex
                   : o->bytes == "base64" ? BytesText::base64
                                          : BytesText::length;
    exit_code = log_cat(o->cat);
  });
}

}  // namespace mimesis::tool
