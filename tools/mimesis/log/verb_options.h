#pragma once
#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/open_log.h"

namespace CLI {
class App;
}  // namespace CLI

// Shared by the sub-verbs of `mimesis log`: options, how they run, JSON on standard output.
namespace mimesis::tool {

// Each adds one sub-verb; exit codes as in verb.h.
void add_record(CLI::App& log, int& exit_code);
void add_play(CLI::App& log, int& exit_code);
void add_replay(CLI::App& log, int& exit_code);
void add_info(CLI::App& log, int& exit_code);
void add_cat(CLI::App& log, int& exit_code);
void add_check(CLI::App& log, int& exit_code);
void add_recover(CLI::App& log, int& exit_code);
void add_filter(CLI::App& log, int& exit_code);
void add_diff(CLI::App& log, int& exit_code);
void add_export(CLI::App& log, int& exit_code);
void add_convert(CLI::App& log, int& exit_code);
void add_plot(CLI::App& log, int& exit_code);
void add_restore(CLI::App& log, int& exit_code);
void add_clean(CLI::App& log, int& exit_code);

/// --topic, --regex, --exclude.
void add_topic_options(CLI::App& verb, TopicOptions& options);
/// --start and --end.
void add_time_options(CLI::App& verb, TimeRange& range);

/// IN... and OUT, or IN... -o OUT. After parsing `take_output` distinguishes them.
void add_input_output(CLI::App& verb, std::vector<std::string>& inputs, OutputOptions& output);
/// @throws ConfigError if one of them is missing.
void take_output(std::vector<std::string>& inputs, OutputOptions& output);

/// A number of bytes: 4096, 512kB, 4MiB.
struct SizeRange {
  std::size_t least, most;  ///< [bytes]
};
void add_size_option(CLI::App& verb, const std::string& name, std::size_t& size, SizeRange range,
                     const std::string& about);

/// --force, --compression, --level, --chunk-size.
void add_output_options(CLI::App& verb, OutputOptions& options);

/// Calls `run` when the verb is chosen; a VerbEnd becomes its line and its exit code.
void on_run(CLI::App& verb, int& exit_code, std::function<int()> run);

/// One line on standard output.
void print_json(const nlohmann::ordered_json& object);
template <class T>
nlohmann::ordered_json json_or_null(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

}  // namespace mimesis::tool
