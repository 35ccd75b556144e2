#include "tools/mimesis/log/record.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/log/writer.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/log/recording.h"
#include "tools/mimesis/stop_signals.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using std::chrono::steady_clock;

constexpr auto kPoll = 10ms;   // how late a signal or a full chunk may be noticed
constexpr auto kQuiet = 50ms;  // without a message after the stop: nothing is under way any more
constexpr auto kDrainAtMost = 2s;

std::uint64_t wall_ns() {
  return static_cast<std::uint64_t>(
      std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count());
}

/// The times of a message: on a simulated clock the graph's, so that equal runs give equal logs.
Recorded recorded(runtime::Tapped tapped) {
  Recorded m;
  m.topic = std::move(tapped.topic);
  m.type = std::move(tapped.type);
  m.type_hash = tapped.type_hash;
  m.node = std::move(tapped.message.source);
  m.seq = tapped.message.seq;
  m.payload = std::move(tapped.message.payload);
  m.publish_time_ns = static_cast<std::uint64_t>(tapped.message.stamp.count());
  if (tapped.publisher != nullptr) {
    m.start_id = tapped.publisher->start_id();
    // The clock node itself steps on the wall clock, but what it says is graph time.
    m.ordered = tapped.publisher->clock() == "sim" || tapped.publisher->clock() == "lockstep" ||
                m.type == v1::ClockTime::descriptor()->full_name();
    for (const auto& output : tapped.publisher->outputs()) {
      if (output.topic() == m.topic) m.latched = output.latched();
    }
  }
  if (tapped.tick.count() > 0) {
    m.log_time_ns = static_cast<std::uint64_t>(tapped.tick.count());
  } else {
    m.log_time_ns = m.ordered ? m.publish_time_ns : wall_ns();
  }
  return m;
}

log::Result attach_file(log::Writer& writer, const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream content;
  if (!in || !(content << in.rdbuf())) throw ConfigError("--attach: cannot read '" + path + "'");
  const std::string data = content.str();
  const std::filesystem::path name(path);
  log::Attachment attachment;
  attachment.log_time = attachment.create_time = wall_ns();
  attachment.name = name.filename().string();
  attachment.media_type =
      name.extension() == ".yaml" ? "application/yaml" : "application/octet-stream";
  attachment.data = data;
  return writer.attach(attachment);
}

/// Receives until stopped. The result is a failure to write.
log::Result receive(const RecordOptions& options, const StopSignals& stop, runtime::Tap& tap,
                    Recording& recording, std::uint64_t started_ns) {
  const auto start = steady_clock::now();
  const auto take = [&](std::chrono::milliseconds patience) -> tl::expected<bool, Status> {
    auto tapped = tap.next(patience);
    const auto now = steady_clock::now();
    if (tapped) {
      const bool from_first =
          tapped->publisher != nullptr && tapped->publisher->started_ns() > started_ns;
      if (auto done = recording.add(recorded(*std::move(tapped)), now, from_first); !done) {
        return tl::unexpected(done.error());
      }
    }
    if (auto done = recording.advance(now); !done) return tl::unexpected(done.error());
    return tapped.has_value();
  };
  const auto due = [&] {
    return options.duration_s > 0.0 &&
           steady_clock::now() - start >= std::chrono::duration<double>(options.duration_s);
  };
  while (!stop.requested() && !due()) {
    if (auto taken = take(kPoll); !taken) return tl::unexpected(taken.error());
  }
  const auto give_up = steady_clock::now() + kDrainAtMost;
  while (steady_clock::now() < give_up) {
    const auto taken = take(kQuiet);
    if (!taken) return tl::unexpected(taken.error());
    if (!*taken) break;
  }
  return {};
}

void report(const RecordOptions& options, const Recording& recording, const log::Writer& writer,
            const std::string& failure) {
  const log::Statistics& s = writer.statistics();
  if (options.json) {
    nlohmann::ordered_json out{
        {"file", options.output},   {"messages", s.message_count},
        {"lost", recording.lost()}, {"bytes", writer.bytes_written()},
        {"error", failure},         {"topics", nlohmann::ordered_json::array()}};
    for (const auto& [key, count] : recording.counts()) {
      out["topics"].push_back({{"topic", key.first},
                               {"node", key.second},
                               {"received", count.received},
                               {"lost", count.lost}});
    }
    std::cout << out.dump() << std::endl;
  } else {
    Table table({"TOPIC", "NODE", "RECEIVED", "LOST"});
    for (const auto& [key, count] : recording.counts()) {
      table.row(
          {key.first, key.second, std::to_string(count.received), std::to_string(count.lost)});
    }
    table.print(std::cerr, use_colour(2));
  }
  std::cerr << fmt::format("{}: {} messages, {} lost\n", options.output, s.message_count,
                           recording.lost());
  for (const std::string& topic : options.filter.topics()) {
    const bool seen = std::ranges::any_of(recording.counts(),
                                          [&](const auto& c) { return c.first.first == topic; });
    if (!seen) std::cerr << fmt::format("topic {}: not one message\n", topic);
  }
}

}  // namespace

int log_record(const RecordOptions& options) {
  const StopSignals stop;   // to the end: the file is to be closed
  std::error_code ignored;  // create_file says what is wrong
  std::filesystem::create_directories(std::filesystem::path(options.output).parent_path(), ignored);
  auto sink = log::create_file(options.output);
  if (!sink) throw ConfigError(sink.error().reason);
  log::WriterOptions writer_options;
  writer_options.library = "mimesis " MIMESIS_VERSION;
  writer_options.compression = options.compression;
  log::Writer writer(**sink, writer_options);
  log::Result done;
  for (const std::string& path : options.attach) {
    if (done) done = attach_file(writer, path);
  }
  if (done)
    done = writer.flush();  // a disk that is full already is told before anybody relies on us
  if (!done) throw ConfigError(done.error().reason);

  const std::uint64_t started_ns = wall_ns();
  runtime::Tap tap(runtime::graph_name(), options.filter, runtime::Policy::reliable);
  Recording recording(writer, [&tap](const std::string& type) { return tap.descriptors(type); });
  done = receive(options, stop, tap, recording, started_ns);
  if (done) done = recording.finish();
  if (done) done = writer.finish();
  if (!done) std::cerr << "recording stopped: " << done.error().reason << '\n';
  report(options, recording, writer, done ? "" : done.error().reason);
  return done && recording.lost() == 0 ? 0 : 1;
}

}  // namespace mimesis::tool
