#include "tools/mimesis/log/merge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "common/runtime/suggest.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/log/latched_repeats.h"
#include "tools/mimesis/log/rewriting.h"

namespace mimesis::tool {
namespace {

using Item = log::MergedReader::Item;

constexpr double kLargest_s = 1e9;

std::vector<std::int64_t> offsets_ns(const MergeOptions& options) {
  std::vector<std::int64_t> offsets;
  for (const std::string& input : options.inputs) {
    const auto it = options.offsets_s.find(input);
    offsets.push_back(it == options.offsets_s.end() ? 0 : std::llround(it->second * 1e9));
  }
  for (const auto& [file, seconds] : options.offsets_s) {
    if (std::ranges::find(options.inputs, file) == options.inputs.end()) {
      throw ConfigError(fmt::format("--offset: '{}' is not among the files to merge{}", file,
                                    runtime::did_you_mean(file, options.inputs)));
    }
  }
  return offsets;
}

}  // namespace

std::pair<std::string, double> parse_offset(const std::string& text) {
  const std::size_t equals = text.rfind('=');
  if (equals != std::string::npos && equals > 0) {
    const auto seconds = runtime::to_double(std::string_view(text).substr(equals + 1));
    if (seconds && std::abs(*seconds) <= kLargest_s) return {text.substr(0, equals), *seconds};
  }
  throw ConfigError(fmt::format("--offset: expected FILE=SECONDS, found '{}'", text));
}

int log_merge(const MergeOptions& options) {
  const auto offsets = offsets_ns(options);
  const auto logs = open_logs(options.inputs);
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  OutputOptions output = options.output;
  output.profile = common_profile(*logs);
  NewLog out(output, options.inputs);
  LatchedRepeats repeats;
  Pass pass = each_message(
      "merge", *logs, {},
      [&](const Item& item) { return repeats.repeated(item) ? log::Result{} : out.copy(item); },
      offsets);
  copy_attachments(*logs, out, pass);
  copy_metadata(*logs, out, pass, read_losses(*logs));
  for (const std::string& schema : out.conflicts()) {
    std::cerr << fmt::format("{} is defined differently in the inputs: kept apart\n", schema);
  }
  return conclude(out, pass, options.json,
                  {{"conflicts", nlohmann::ordered_json(out.conflicts())}});
}

}  // namespace mimesis::tool
