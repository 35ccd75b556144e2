#include "tools/mimesis/log/verb_options.h"

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "common/error.h"

namespace mimesis::tool {

void add_topic_options(CLI::App& verb, TopicOptions& options) {
  verb.add_option("--topic", options.topics, "Only this topic (repeatable)")
      ->allow_extra_args(false);
  verb.add_option("--regex", options.regex, "Only topics that match as a whole");
  verb.add_option("--exclude", options.exclude, "Not those that match as a whole");
}

TopicFilter filter_of(const TopicOptions& options) {
  return {options.topics, options.regex, options.exclude};
}

void add_time_options(CLI::App& verb, TimeRange& range) {
  verb.add_option("--start", range.start,
                  "From this log time on: seconds from the first message (12.5), absolute "
                  "(12500000000ns) or UTC (2026-11-21T15:40:00.5Z)");
  verb.add_option("--end", range.end, "Before this log time");
}

void add_input_output(CLI::App& verb, std::vector<std::string>& inputs, OutputOptions& output) {
  verb.add_option("FILE", inputs, "MCAP files to read; without -o the last one is written")
      ->required();
  verb.add_option("--output,-o", output.path, "File to write");
}

void take_output(std::vector<std::string>& inputs, OutputOptions& output) {
  if (!output.path.empty()) return;
  if (inputs.size() < 2) throw ConfigError("say where to: IN OUT, or IN -o OUT");
  output.path = inputs.back();
  inputs.pop_back();
}

void add_output_options(CLI::App& verb, OutputOptions& options) {
  verb.add_flag("--force", options.force, "Replace the output if it exists");
  verb.add_option_function<std::string>(
          "--compression",
          [&options](const std::string& name) {
            options.compression = *log::parse_compression(name);
          },
          "Of chunks (default zstd)")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}));
  verb.add_option("--level", options.zstd_level, "Of zstd: 1 fast, 19 small")
      ->check(CLI::Range(1, 19))
      ->capture_default_str();
  verb.add_option("--chunk-size", options.chunk_size,
                  "Records before compression [bytes], 1M, 512k")
      ->transform(CLI::AsSizeValue(false))
      ->check(CLI::Range(std::size_t{1} << 10, std::size_t{1} << 29))
      ->capture_default_str();
}

}  // namespace mimesis::tool
