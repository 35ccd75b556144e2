#include "tools/mimesis/log/diff.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>

#include "common/runtime/own_topics.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {
namespace {

/// A message, or a copy of one that waits for its counterpart.
struct Held {
  std::uint64_t sequence;
  std::uint64_t log_time, publish_time;
  std::string bytes;
  const log::Schema* schema;
};

struct Stream {
  StreamDiff diff;
  const DiffRules* rules = nullptr;
  bool in_a = false, in_b = false;
  std::uint64_t read[2] = {0, 0};
  std::deque<Held> waiting[2];  ///< of the log that is ahead
};

/// Topic, node, and how often that node had been started before: the ids of its starts differ
/// between runs.
using StreamKey = std::tuple<std::string, std::string, std::size_t>;

struct Side {
  const OpenLog* log = nullptr;
  std::unique_ptr<log::IndexedReader> reader;
  const log::Message* next = nullptr;
  std::map<std::uint16_t, std::pair<Stream*, const log::Schema*>> streams;  ///< by channel

  /// From the log's own start, so that runs of two days go side by side.
  std::uint64_t time() const { return next->log_time - log->summary.statistics.message_start_time; }
};

class LogComparison {
 public:
  LogComparison(const OpenLog& a, const OpenLog& b, const DiffOptions& options)
      : options_(options), rules_(diff_rules(options, a, b)) {
    open(0, a);
    open(1, b);
  }

  void run() {
    const OpenLog& a = *sides_[0].log;
    Progress progress("diff", a.source->size());
    const log::Statistics& s = a.summary.statistics;
    const double bytes_per_ns =
        static_cast<double>(a.source->size()) /
        static_cast<double>(std::max<std::uint64_t>(1, s.message_end_time - s.message_start_time));
    while (sides_[0].next != nullptr || sides_[1].next != nullptr) {
      const bool from_b = sides_[0].next == nullptr ||
                          (sides_[1].next != nullptr && sides_[1].time() < sides_[0].time());
      Side& side = sides_[from_b ? 1 : 0];
      progress.at(static_cast<std::uint64_t>(static_cast<double>(side.time()) * bytes_per_ns));
      take(from_b ? 1 : 0, *side.next);
      side.next = side.reader->next();
    }
  }

  std::vector<StreamDiff> result() {
    std::vector<StreamDiff> all;
    for (auto& [key, stream] : streams_) {
      stream.diff.only_a += stream.waiting[0].size();
      stream.diff.only_b += stream.waiting[1].size();
      if (stream.diff.a + stream.diff.b > 0) all.push_back(std::move(stream.diff));
    }
    return all;
  }

  std::uint64_t report() const {
    std::uint64_t damages = 0;
    for (const Side& side : sides_) {
      const log::Summary& summary = side.log->summary;
      damages += report_damages(side.log->path, summary.damages, summary.damage_count);
      if (summary.damage_count > 0) continue;  // the reader met the same
      const auto& met = side.reader->damages();
      damages += report_damages(side.log->path, met, met.size());
    }
    return damages;
  }

 private:
  void open(std::size_t index, const OpenLog& log) {
    Side& side = sides_[index];
    side.log = &log;
    std::map<std::pair<std::string, std::string>, std::vector<std::string>> starts;
    for (const auto& [id, channel] : log.summary.channels) {
      if (options_.topic && !options_.topic(channel.topic)) continue;
      const std::string node = sender_of(channel), start_id = start_of(channel);
      auto& known = starts[{channel.topic, node}];
      const auto before =
          static_cast<std::size_t>(std::ranges::find(known, start_id) - known.begin());
      if (before == known.size()) known.push_back(start_id);
      Stream& stream = streams_[{channel.topic, node, before}];
      stream.diff.topic = channel.topic;
      stream.diff.node = node;
      stream.rules = &rules_.at(channel.topic);
      (index == 0 ? stream.in_a : stream.in_b) = true;
      const auto schema = log.summary.schemas.find(channel.schema_id);
      const bool described = schema != log.summary.schemas.end();
      if (described) (index == 0 ? stream.diff.type_a : stream.diff.type_b) = schema->second.name;
      side.streams[id] = {&stream, described ? &schema->second : nullptr};
    }
    side.reader = std::make_unique<log::IndexedReader>(
        *log.source, log.summary,
        log::Selection{[&side](const log::Channel& c) { return side.streams.contains(c.id); }});
    side.next = side.reader->next();
  }

  void take(std::size_t side, const log::Message& m) {
    const auto& [stream, schema] = sides_[side].streams.at(m.channel_id);
    StreamDiff& diff = stream->diff;
    ++(side == 0 ? diff.a : diff.b);
    if (!stream->in_a || !stream->in_b) {
      ++(side == 0 ? diff.only_a : diff.only_b);
      return;
    }
    const std::uint64_t count = ++stream->read[side];
    const std::uint64_t sequence = m.sequence != 0 ? m.sequence : count;
    auto& others = stream->waiting[1 - side];
    for (; !others.empty() && others.front().sequence < sequence; others.pop_front()) {
      ++(side == 0 ? diff.only_b : diff.only_a);
    }
    Held held{sequence, m.log_time, m.publish_time, std::string(m.data), schema};
    if (others.empty() || others.front().sequence != sequence) {
      stream->waiting[side].push_back(std::move(held));
      return;
    }
    const Held other = std::move(others.front());
    others.pop_front();
    side == 0 ? compare(*stream, held, other) : compare(*stream, other, held);
  }

  void compare(Stream& stream, const Held& a, const Held& b) {
    StreamDiff& diff = stream.diff;
    auto difference =
        payloads_.diff({a.bytes, a.schema}, {b.bytes, b.schema}, *stream.rules, &diff.worst);
    if (options_.times) {
      compare_time("log_time_ns", a.log_time, b.log_time, stream, difference);
      compare_time("publish_time_ns", a.publish_time, b.publish_time, stream, difference);
    }
    ++(difference.equal() ? diff.equal : diff.differing);
    if (difference.equal() || diff.first) return;
    diff.first = {a.sequence, a.log_time, b.log_time, std::move(difference)};
  }

  static void compare_time(const std::string& name, std::uint64_t a, std::uint64_t b,
                           Stream& stream, MessageDifference& out) {
    if (a == b) return;
    const FieldDifference line{name, std::to_string(a), std::to_string(b)};
    const auto distance = static_cast<double>(a < b ? b - a : a - b);
    WorstDifference& worst = stream.diff.worst[name];
    if (distance > worst.difference) worst = {distance, name, line.a, line.b};
    out.fields.insert(out.fields.begin(), line);
    ++out.count;
  }

  const DiffOptions& options_;
  std::map<std::string, DiffRules> rules_;  ///< by topic
  std::map<StreamKey, Stream> streams_;
  Side sides_[2];
  PayloadDiff payloads_;
};

}  // namespace

bool is_runtime_topic(const std::string& topic) {
  return topic == "clock/time" || runtime::is_own_topic(topic);
}

std::vector<StreamDiff> diff_logs(const OpenLog& a, const OpenLog& b, const DiffOptions& options,
                                  std::uint64_t& damages) {
  LogComparison comparison(a, b, options);
  comparison.run();
  damages += comparison.report();
  return comparison.result();
}

}  // namespace mimesis::tool
