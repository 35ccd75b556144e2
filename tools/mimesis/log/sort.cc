#include <fmt/format.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <queue>
#include <vector>

#include "common/error.h"
#include "common/log/wire.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/rewrite.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kHeldPerMessage = 64;  // held besides its payload [bytes]

/// Messages on the way from a run back into a log.
class RunReader {
 public:
  explicit RunReader(std::unique_ptr<log::Source> source)
      : source_(std::move(source)), window_(*source_) {}
  /// False at the end of the run.
  tl::expected<bool, Status> next() {
    if (at_ >= source_->size()) return false;
    const auto head = window_.view(at_, log::kRecordHead);
    if (!head) return tl::unexpected(head.error());
    log::Decoder d(head->substr(1));
    const auto length = d.integer<std::uint64_t>();
    const auto record = window_.view(at_, static_cast<std::size_t>(log::kRecordHead + length));
    if (!record) return tl::unexpected(record.error());
    at_ += log::kRecordHead + length;
    if (record->size() < log::kRecordHead + length ||
        !log::decode(record->substr(log::kRecordHead), message_)) {
      return tl::unexpected(Status{"a piece of the log reads back wrong"});
    }
    return true;
  }
  const log::Message& message() const { return message_; }

 private:
  std::unique_ptr<log::Source> source_;
  log::Window window_;
  std::uint64_t at_ = 0;
  log::Message message_;
};

/// A log cut into runs of messages that fit into memory, each sorted, in files beside the output:
/// bare message records. Reading them back takes a small window per run.
class SortedRuns {
 public:
  SortedRuns(const SortOptions& options, const OpenLog& log) : options_(options), log_(log) {}
  ~SortedRuns() {
    for (const std::string& path : paths_) std::remove(path.c_str());
  }
  SortedRuns(const SortedRuns&) = delete;
  SortedRuns& operator=(const SortedRuns&) = delete;

  Pass cut() {
    Pass pass;
    const StopSignals stop;
    Progress progress("sort, first pass", log_.source->size());
    log::StreamReader reader(*log_.source);
    while (const log::Record* record = reader.next()) {
      const auto* message = std::get_if<log::Message>(record);
      if (message == nullptr) continue;
      held_.push_back({*message, std::string(message->data)});
      held_bytes_ += message->data.size() + kHeldPerMessage;
      progress.at(reader.offset());
      pass.interrupted = stop.requested();
      if (pass.interrupted) return pass;
      if (held_bytes_ < options_.memory) continue;
      pass.done = write_run();
      if (!pass.done) return pass;
    }
    pass.done = write_run();
    return pass;
  }

  /// Equal times in the order of the runs: that of the file.
  Pass merge(NewLog& out) {
    Pass pass;
    const auto readers = open();
    if (!readers) {
      pass.done = tl::unexpected(readers.error());
      return pass;
    }
    using Head = std::pair<std::uint64_t, std::size_t>;  // log time, run
    std::priority_queue<Head, std::vector<Head>, std::greater<>> heads;
    const auto advance = [&](std::size_t run) {
      const auto more = (*readers)[run]->next();
      if (!more) {
        pass.done = tl::unexpected(more.error());
      } else if (*more) {
        heads.emplace((*readers)[run]->message().log_time, run);
      }
    };
    for (std::size_t run = 0; run < readers->size(); ++run) advance(run);
    const StopSignals stop;
    Progress progress("sort", bytes_);
    std::uint64_t done = 0;
    while (pass.done && !heads.empty()) {
      const std::size_t run = heads.top().second;
      heads.pop();
      const log::Message& message = (*readers)[run]->message();
      pass.done = copy(message, out);
      if (!pass.done) return pass;
      progress.at(done += message.data.size());
      pass.interrupted = stop.requested();
      if (pass.interrupted) return pass;
      advance(run);
    }
    return pass;
  }

 private:
  struct HeldRecord {
    log::Message message;
    std::string data;
  };
  log::Result write_run() {
    std::ranges::stable_sort(held_, {}, [](const HeldRecord& h) { return h.message.log_time; });
    paths_.push_back(fmt::format("{}.run{}", options_.output.path, paths_.size()));
    auto sink = log::create_file(paths_.back());
    if (!sink) return tl::unexpected(sink.error());
    std::string record;
    for (HeldRecord& held : held_) {
      held.message.data = held.data;
      record.clear();
      log::append(record, held.message);
      bytes_ += record.size();
      if (auto done = (*sink)->write(record); !done) return done;
    }
    held_.clear();
    held_bytes_ = 0;
    return (*sink)->close();
  }

  tl::expected<std::vector<std::unique_ptr<RunReader>>, Status> open() const {
    std::vector<std::unique_ptr<RunReader>> readers;
    for (const std::string& path : paths_) {
      auto source = log::open_file(path);
      if (!source) return tl::unexpected(source.error());
      readers.push_back(std::make_unique<RunReader>(std::move(*source)));
    }
    return readers;
  }

  log::Result copy(const log::Message& message, NewLog& out) const {
    const auto channel = log_.summary.channels.find(message.channel_id);
    if (channel == log_.summary.channels.end()) return {};  // told as damage
    const auto schema = log_.summary.schemas.find(channel->second.schema_id);
    return out.copy({0, &channel->second,
                     schema == log_.summary.schemas.end() ? nullptr : &schema->second, &message});
  }

  const SortOptions& options_;
  const OpenLog& log_;
  std::vector<std::string> paths_;
  std::vector<HeldRecord> held_;
  std::uint64_t held_bytes_ = 0, bytes_ = 0;
};

Pass sort_in_pieces(const SortOptions& options, const OpenLog& log, NewLog& out) {
  SortedRuns runs(options, log);
  Pass pass = runs.cut();
  if (pass.done && !pass.interrupted) pass = runs.merge(out);
  pass.damages += report_losses(log, log.summary.damages, log.summary.damage_count);
  return pass;
}

/// The log by its data: an index that is wrong must not spoil the order. @throws VerbEnd
OpenLog scan_log(const std::string& path) {
  OpenLog log = std::move(opened({path}).front());
  if (!log.summary.from_file) return log;
  auto scanned = log::scan(*log.source);
  if (!scanned) throw VerbEnd{path + ": " + scanned.error().reason, 1};
  log.summary = std::move(*scanned);
  return log;
}

}  // namespace

int log_sort(const SortOptions& options) {
  OutputOptions output = options.output;
  std::vector<OpenLog> logs;
  logs.push_back(scan_log(options.input));
  output.profile = common_profile(logs);
  NewLog out(output, {options.input});
  const bool fits = overlap_bytes(logs.front().summary) <= options.memory;
  Pass pass = fits
                  ? each_message("sort", logs, {}, [&](const Item& item) { return out.copy(item); })
                  : sort_in_pieces(options, logs.front(), out);
  copy_attachments(logs, out, pass);
  copy_metadata(logs, out, pass, std::nullopt);
  return conclude(out, pass, options.json);
}

void add_sort(CLI::App& verb, int& exit_code) {
  CLI::App* sort =
      verb.add_subcommand("sort", "Writes a log in the order of log time (like mcap sort)");
  struct Options : SortOptions {
    std::vector<std::string> inputs;
  };
  auto o = std::make_shared<Options>();
  add_input_output(*sort, o->inputs, o->output);
  add_output_options(*sort, o->output);
  add_size_option(*sort, "--memory", o->memory, {std::size_t{1} << 16, std::size_t{1} << 40},
                  "Most unpacked bytes to hold (default 512MiB); what is further out of order is "
                  "sorted in files beside the output");
  sort->add_flag("--json", o->json, "Print what was written as one JSON object");
  sort->footer(
      "Equal times stay in the order of the file. Every sum of the file is checked; exit code 1 if "
      "it is damaged.\nExample: mimesis log sort run.mcap -o sorted.mcap");
  on_run(*sort, exit_code, [o] {
    take_output(o->inputs, o->output);
    if (o->inputs.size() != 1) throw ConfigError("expected one log to sort: merge joins several");
    o->input = o->inputs.front();
    return log_sort(*o);
  });
}

}  // namespace mimesis::tool
