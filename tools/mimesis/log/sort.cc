#include "tools/mimesis/log/sort.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "tools/mimesis/log/progress.h"
#include "tools/mimesis/log/rewriting.h"
#include "tools/mimesis/stop_signals.h"

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kPerMessage = 64;  // held besides its payload [bytes]

/// A log cut into runs of messages that fit into memory, each sorted, in files beside the output.
class Runs {
 public:
  explicit Runs(const SortOptions& options) : options_(options) {}
  ~Runs() {
    for (const std::string& path : paths_) std::remove(path.c_str());
  }
  Runs(const Runs&) = delete;
  Runs& operator=(const Runs&) = delete;

  Pass cut(const OpenLog& log);
  const std::vector<std::string>& paths() const { return paths_; }

 private:
  struct Held {
    log::Message message;
    const log::Channel* channel;
    std::string data;
  };
  log::Result write_run(const log::Summary& summary);

  const SortOptions& options_;
  std::vector<std::string> paths_;
  std::vector<Held> held_;
  std::uint64_t held_bytes_ = 0;
};

Pass Runs::cut(const OpenLog& log) {
  Pass pass;
  const StopSignals stop;
  Progress progress("sort, first pass", log.source->size());
  log::StreamReader reader(*log.source);
  while (const log::Record* record = reader.next()) {
    const auto* message = std::get_if<log::Message>(record);
    if (message == nullptr) continue;
    const auto channel = log.summary.channels.find(message->channel_id);
    if (channel == log.summary.channels.end()) continue;  // told as damage
    held_.push_back({*message, &channel->second, std::string(message->data)});
    held_bytes_ += message->data.size() + kPerMessage;
    progress.at(reader.offset());
    pass.interrupted = stop.requested();
    if (pass.interrupted) return pass;
    if (held_bytes_ < options_.memory) continue;
    pass.done = write_run(log.summary);
    if (!pass.done) return pass;
  }
  pass.done = write_run(log.summary);
  return pass;
}

log::Result Runs::write_run(const log::Summary& summary) {
  std::ranges::stable_sort(held_, {}, [](const Held& h) { return h.message.log_time; });
  OutputOptions options;
  options.path = fmt::format("{}.run{}", options_.output.path, paths_.size());
  options.force = true;
  options.compression = log::Compression::none;
  NewLog run(options, {options_.input});
  for (Held& held : held_) {
    const auto schema = summary.schemas.find(held.channel->schema_id);
    held.message.data = held.data;
    if (auto done =
            run.copy({0, held.channel, schema == summary.schemas.end() ? nullptr : &schema->second,
                      &held.message});
        !done) {
      return done;
    }
  }
  paths_.push_back(options.path);
  held_.clear();
  held_bytes_ = 0;
  return run.finish();
}

Pass sort_in_pieces(const SortOptions& options, const OpenLog& log, NewLog& out) {
  Runs runs(options);
  Pass first = runs.cut(log);
  if (!first.done || first.interrupted) return first;
  const auto pieces = open_logs(runs.paths());
  if (!pieces) {
    first.done = tl::unexpected(Status{pieces.error().line});
    return first;
  }
  Pass pass = each_message("sort", *pieces, {},
                           [&](const log::MergedReader::Item& item) { return out.copy(item); });
  pass.damages += report_losses(log, log.summary.damages, log.summary.damage_count);
  return pass;
}

/// The log by its data: an index that is wrong must not spoil the order.
tl::expected<OpenLog, OpenError> scan_log(const std::string& path) {
  auto log = open_log(path);
  if (!log || !log->summary.from_file) return log;
  auto scanned = log::scan(*log->source);
  if (!scanned) return tl::unexpected(OpenError{path + ": " + scanned.error().reason, 1});
  log->summary = std::move(*scanned);
  return log;
}

}  // namespace

int log_sort(const SortOptions& options) {
  OutputOptions output = options.output;
  std::vector<OpenLog> logs;
  if (auto log = scan_log(options.input)) {
    logs.push_back(std::move(*log));
  } else {
    std::cerr << log.error().line << '\n';
    return log.error().exit_code;
  }
  output.profile = common_profile(logs);
  NewLog out(output, {options.input});
  const bool fits = overlap_bytes(logs.front().summary) <= options.memory;
  Pass pass =
      fits ? each_message("sort", logs, {},
                          [&](const log::MergedReader::Item& item) { return out.copy(item); })
           : sort_in_pieces(options, logs.front(), out);
  copy_attachments(logs, out, pass);
  copy_metadata(logs, out, pass, std::nullopt);
  return conclude(out, pass, options.json);
}

}  // namespace mimesis::tool
