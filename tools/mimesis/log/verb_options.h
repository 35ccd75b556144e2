#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "tools/mimesis/log/log_time.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/topic_filter.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace mimesis::tool {

// Options that several sub-verbs of `mimesis log` share.

struct TopicOptions {
  std::vector<std::string> topics;
  std::string regex, exclude;
};
void add_topic_options(CLI::App& verb, TopicOptions& options);
/// @throws ConfigError
TopicFilter filter_of(const TopicOptions& options);

/// --start and --end.
void add_time_options(CLI::App& verb, TimeRange& range);

/// IN... and OUT, or IN... -o OUT. Behind the parsing `take_output` tells them apart.
void add_input_output(CLI::App& verb, std::vector<std::string>& inputs, OutputOptions& output);
/// @throws ConfigError if one of the two is missing.
void take_output(std::vector<std::string>& inputs, OutputOptions& output);

/// A number of bytes: 4096, 512kB, 4MiB.
struct SizeRange {
  std::size_t least, most;  ///< [bytes]
};
void add_size_option(CLI::App& verb, const std::string& name, std::size_t& size, SizeRange range,
                     const std::string& about);

/// --force, --compression, --level, --chunk-size.
void add_output_options(CLI::App& verb, OutputOptions& options);

}  // namespace mimesis::tool
