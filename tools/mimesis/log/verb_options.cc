#include "tools/mimesis/log/verb_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/json_text.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
void add_topic_options(CLI::App& verb, TopicOptions& options) {
  verb.add_option("--topic", options.topics, "Only this topic (repeatable)")
      ->allow_extra_args(false);
  verb.add_option("--regex", options.regex, "Only topics that match as a whole");
  verb.add_option("--exclude", options.exclude, "Exclude topics that match as a whole");
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

void add_size_option(CLI::App& verb, const std::string& name, std::size_t& size, SizeRange range,
                     const std::string& about) {
  const auto check = [range](const std::string& text) -> std::string {
    const auto bytes = to_bytes(text);
    if (bytes && *bytes >= range.least && *bytes <= range.most) return "";
    return fmt::format("expected a size from {} to {} such as 4MiB, found '{}'",
                       bytes_text(range.least), bytes_text(range.most), text);
  };
  verb.add_option_function<std::string>(
          name, [&size](const std::string& text) { size = *to_bytes(text); }, about)
      ->check(check);
}

void add_output_options(CLI::App& verb, OutputOptions& options) {
  verb.add_flag("--force", options.force, "Replace the output if it exists");
  verb.add_option_function<std::string>(
          "--compression",
          [&options](const std::string& name) {
            options.compression = *log::parse_compression(name);
          },
          "Compression of chunks (default zstd)")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}));
  verb.add_option("--level", options.zstd_level, "Level of zstd: 1 fast, 19 small")
      ->check(CLI::Range(1, 19))
      ->capture_default_str();
  add_size_option(verb, "--chunk-size", options.chunk_size,
                  {std::size_t{1} << 10, std::size_t{1} << 29},
                  "Records of a chunk before compression (default 1MiB)");
}

void on_run(CLI::App& verb, int& exit_code, std::function<int()> run) {
  verb.callback([run = std::move(run), &exit_code] {
    try {
      exit_code = run();
    } catch (const VerbEnd& end) {
      if (!end.line.empty()) std::cerr << printable(end.line) << '\n';
      exit_code = end.exit_code;
    }
  });
}

void print_json(const nlohmann::ordered_json& object) { std::cout << json_text(object) << '\n'; }

}  // namespace mimesis::tool
