#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <CLI/Validators.hpp>
#include <fstream>
#include <memory>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/log/byte_size.h"
#include "tools/mimesis/log/record.h"
#include "tools/mimesis/log/subverbs.h"
#include "tools/mimesis/number_check.h"

namespace mimesis::tool {
namespace {

struct Options {
  std::vector<std::string> topics, attach, snapshot_on;
  std::string regex, exclude, output, compression = "zstd";
  bool all = false, json = false, quiet = false;
  double duration_s = 0.0;
  std::string split_size, split_duration, snapshot, snapshot_size, snapshot_after;
  std::string max_size, min_free, when_full = "stop", sync;
};

/// For CLI::Option::check: what is wrong, or nothing.
std::string size_check(const std::string& text) {
  const auto bytes = to_bytes(text);
  return bytes && *bytes > 0 ? "" : "expected a size such as 500MB or 2GiB, found '" + text + "'";
}

std::string duration_check(const std::string& text) {
  const auto duration = runtime::to_duration(text);
  return duration && duration->count() > 0
             ? ""
             : "expected a duration such as 500ms, 30s or 10min, found '" + text + "'";
}

std::optional<double> to_percent(const std::string& text) {
  if (!text.ends_with('%')) return std::nullopt;
  const auto percent = runtime::to_double(text.substr(0, text.size() - 1));
  return percent && *percent > 0.0 && *percent < 100.0 ? percent : std::nullopt;
}

std::string free_check(const std::string& text) {
  return to_percent(text) || size_check(text).empty()
             ? ""
             : "expected a size such as 2GB or a percentage such as 5%, found '" + text + "'";
}

// Checked before; empty: not given.
std::uint64_t bytes(const std::string& text) { return text.empty() ? 0 : *to_bytes(text); }
std::chrono::nanoseconds duration(const std::string& text) {
  return text.empty() ? std::chrono::nanoseconds(0) : *runtime::to_duration(text);
}

/// The words of this process's command line.
std::vector<std::string> command_line() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(in, word, '\0');) words.push_back(word);
  return words;
}

[[noreturn]] void refuse(const std::string& why) {
  throw ConfigError("mimesis log record: " + why);
}

void check(const Options& o) {
  const bool splits = !o.split_size.empty() || !o.split_duration.empty();
  const bool snapshots = !o.snapshot.empty();
  if (!o.all && o.topics.empty() && o.regex.empty()) {
    refuse("say what: --all, --topic NAME or --regex RE");
  }
  if (o.all && !(o.topics.empty() && o.regex.empty())) {
    refuse("--all leaves nothing for --topic and --regex to choose");
  }
  if (splits && snapshots) refuse("--snapshot writes single files: there is nothing to split");
  if (!snapshots &&
      !(o.snapshot_size.empty() && o.snapshot_after.empty() && o.snapshot_on.empty())) {
    refuse("--snapshot-size, --snapshot-after and --snapshot-on need --snapshot DURATION");
  }
  const bool limited = !o.max_size.empty() || !o.min_free.empty();
  if (o.when_full == "delete-oldest" && !(limited && (splits || snapshots))) {
    refuse(
        "--when-full delete-oldest needs a limit (--max-size or --min-free) and several files "
        "(--split-size, --split-duration or --snapshot)");
  }
  if (o.when_full == "delete-oldest" && bytes(o.max_size) > 0 &&
      bytes(o.split_size) >= bytes(o.max_size)) {
    refuse("--split-size must be less than --max-size, or the oldest file is the only one");
  }
}

RecordOptions parsed(const Options& o) {
  RecordOptions options{.filter = TopicFilter(o.topics, o.regex, o.exclude), .output = o.output};
  options.compression = *log::parse_compression(o.compression);
  options.duration_s = o.duration_s;
  options.attach = o.attach;
  options.split = {.size = bytes(o.split_size), .duration = duration(o.split_duration)};
  options.snapshot.duration = duration(o.snapshot);
  if (!o.snapshot_size.empty()) options.snapshot.size = bytes(o.snapshot_size);
  options.snapshot.after = duration(o.snapshot_after);
  options.snapshot.topics = o.snapshot_on;
  options.limits.max_size = bytes(o.max_size);
  const auto percent = to_percent(o.min_free);
  options.limits.min_free_percent = percent.value_or(0.0);
  options.limits.min_free = percent ? 0 : bytes(o.min_free);
  options.limits.delete_oldest = o.when_full == "delete-oldest";
  options.sync = duration(o.sync);
  options.command = command_line();
  options.quiet = o.quiet;
  options.json = o.json;
  return options;
}

void add_what(CLI::App& record, Options& o) {
  record.add_flag("--all", o.all, "All topics");
  record.add_option("--topic", o.topics, "This topic (repeatable)")->allow_extra_args(false);
  record.add_option("--regex", o.regex, "Topics that match as a whole");
  record.add_option("--exclude", o.exclude, "Not those that match as a whole");
  record.add_option("--output,-o", o.output, "File to write; replaced if it exists")->required();
  record.add_option("--compression", o.compression, "Of chunks")
      ->check(CLI::IsMember({"zstd", "lz4", "none"}))
      ->capture_default_str();
  record.add_option("--duration", o.duration_s, "Stop after so many seconds of wall time")
      ->check(number_above_zero);
  record.add_option("--attach", o.attach, "Store this file in the log (repeatable)")
      ->allow_extra_args(false);
  record
      .add_option("--sync", o.sync,
                  "Bring the file to the disk so often, against power cuts (default: never)")
      ->check(duration_check);
  record.add_flag("--quiet", o.quiet, "No counts while recording, no table at the end");
  record.add_flag("--json", o.json, "Print the counts as one JSON object at the end");
}

void add_files(CLI::App& record, Options& o) {
  constexpr auto kSplit = "Several files (run.mcap: run_000.mcap, run_001.mcap, ...)";
  record.add_option("--split-size", o.split_size, "No file becomes larger than this")
      ->check(size_check)
      ->group(kSplit);
  record.add_option("--split-duration", o.split_duration, "A new file after so much log time")
      ->check(duration_check)
      ->group(kSplit);

  constexpr auto kSnapshot = "Snapshots (run.mcap: run_20261121-153000.mcap, ...)";
  record
      .add_option("--snapshot", o.snapshot,
                  "Keep so much of the last time in memory; write it on SIGUSR1")
      ->check(duration_check)
      ->group(kSnapshot);
  record.add_option("--snapshot-size", o.snapshot_size, "At most so much memory (default: 256MB)")
      ->check(size_check)
      ->group(kSnapshot);
  record
      .add_option("--snapshot-on", o.snapshot_on,
                  "Write it, too, on a message on this topic (repeatable)")
      ->allow_extra_args(false)
      ->group(kSnapshot);
  record.add_option("--snapshot-after", o.snapshot_after, "With what follows for so long")
      ->check(duration_check)
      ->group(kSnapshot);

  constexpr auto kLimits = "Limits of the disk";
  record.add_option("--max-size", o.max_size, "Of all files of the recording")
      ->check(size_check)
      ->group(kLimits);
  record.add_option("--min-free", o.min_free, "Left on the disk: a size or a percentage")
      ->check(free_check)
      ->group(kLimits);
  record
      .add_option("--when-full", o.when_full,
                  "Close the log and stop, or delete the recording's own oldest file")
      ->check(CLI::IsMember({"stop", "delete-oldest"}))
      ->capture_default_str()
      ->group(kLimits);
}

}  // namespace

void add_record(CLI::App& verb, int& exit_code) {
  CLI::App* record =
      verb.add_subcommand("record", "Records topics of the graph until it is stopped");
  auto o = std::make_shared<Options>();
  add_what(*record, *o);
  add_files(*record, *o);
  record->footer(
      "Nodes that start after the recorder wait for it: their first message is in the log.\n"
      "SIGINT, SIGTERM and SIGHUP close the log; after kill -9 it opens, too, less the last 100 "
      "ms.\n"
      "Exit code 1 if a message was lost or could not be written, a limit was reached, or no "
      "message came.\n"
      "Examples:\n"
      "  mimesis log record --all --exclude '.*/health' -o run.mcap\n"
      "  mimesis log record --all -o run.mcap --split-size 1GB --max-size 20GB --when-full "
      "delete-oldest\n"
      "  mimesis log record --all -o fault.mcap --snapshot 30s --snapshot-on bridge/fault "
      "--snapshot-after 5s");
  record->callback([o, &exit_code] {
    check(*o);
    exit_code = log_record(parsed(*o));
  });
}

}  // namespace mimesis::tool
