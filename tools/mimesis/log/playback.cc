#include "tools/mimesis/log/playback.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <set>

#include "common/error.h"
#include "common/runtime/own_topics.h"

namespace mimesis::tool {
namespace {

constexpr std::string_view kBecomes = ":=";

std::string without_root(std::string prefix) { return prefix == "/" ? "" : prefix; }

constexpr double kNsPerS = 1e9;
constexpr double kLongest_s = 1e10;  // 317 years: in 64 bits of nanoseconds
/// How far the search for latched values looks back first [ns]; then four times as far each time.
constexpr std::uint64_t kFirstLook = 1'000'000'000;

std::uint64_t added(std::uint64_t a, std::uint64_t b) {
  return b > std::numeric_limits<std::uint64_t>::max() - a
             ? std::numeric_limits<std::uint64_t>::max()
             : a + b;
}

/// Published by the runtime. Foreign topics with such names are played.
bool about_a_node(const std::string& topic, const std::string& type) {
  return runtime::is_own_topic(topic) &&
         (type.starts_with("mimesis.v1.") || type == "foxglove.Log");
}

constexpr std::size_t kBatchBytes = 256 * 1024, kBatchMessages = 1024;
constexpr double kFirstSeconds = 0.5, kMostSeconds = 8.0;

}  // namespace

PlayRemap::PlayRemap(const std::vector<std::string>& rules) {
  for (const std::string& text : rules) {
    const std::size_t at = text.find(kBecomes);
    const std::string from = text.substr(0, at);
    const std::string to = at == std::string::npos ? "" : text.substr(at + kBecomes.size());
    if (from.empty() || to.empty() || from.ends_with('/') != to.ends_with('/')) {
      throw ConfigError("--remap '" + text + "': expected OLD:=NEW, or OLD/:=NEW/ for a prefix");
    }
    const bool prefix = from.ends_with('/');
    const Rule rule{text, prefix ? without_root(from) : from, prefix ? without_root(to) : to,
                    prefix};
    for (const Rule& other : rules_) {
      if (other.from == rule.from && other.prefix == rule.prefix) {
        throw ConfigError("--remap '" + text + "': '" + other.text + "' says otherwise");
      }
    }
    rules_.push_back(rule);
  }
}

const PlayRemap::Rule* PlayRemap::rule_for(const std::string& topic) const {
  const Rule* best = nullptr;
  for (const Rule& rule : rules_) {
    if (rule.prefix ? !topic.starts_with(rule.from) : topic != rule.from) continue;
    if (!rule.prefix) return &rule;
    if (best == nullptr || best->from.size() < rule.from.size()) best = &rule;
  }
  return best;
}

std::string PlayRemap::operator()(const std::string& topic) const {
  const Rule* rule = rule_for(topic);
  return rule == nullptr ? topic : rule->to + topic.substr(rule->from.size());
}

std::vector<std::string> PlayRemap::unused(const std::vector<std::string>& topics) const {
  std::set<const Rule*> used;
  for (const std::string& topic : topics) used.insert(rule_for(topic));
  std::vector<std::string> rest;
  for (const Rule& rule : rules_) {
    if (!used.contains(&rule)) rest.push_back(rule.text);
  }
  return rest;
}

Playback::Playback(std::vector<OpenLog> logs, const PlaybackOptions& options)
    : logs_(std::move(logs)), span_(span_of(logs_)) {
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    for (const log::Damage& d : logs_[i].summary.damages)
      damages_.try_emplace({i, d.offset}, d.what);
  }
  find_topics(options);
  find_range(options.range);
}

std::string Playback::name() const {
  return logs_.size() == 1 ? logs_[0].path
                           : fmt::format("{} and {} more", logs_[0].path, logs_.size() - 1);
}

void Playback::find_topics(const PlaybackOptions& options) {
  std::set<std::string> recorded, foreign;
  const std::vector<std::string>& named = options.filter.topics();
  for (const OpenLog& log : logs_) {
    for (const auto& [id, channel] : log.summary.channels) {
      recorded.insert(channel.topic);
      const auto schema = log.summary.schemas.find(channel.schema_id);
      const bool known = schema != log.summary.schemas.end();
      // The time of the recorded run is not the time of this one.
      if (known && schema->second.name == "mimesis.v1.ClockTime") continue;
      if (!options.filter(channel.topic)) continue;
      if (!known || schema->second.encoding != "protobuf") {
        foreign.insert(channel.topic);
      } else if (options.about_nodes || !about_a_node(channel.topic, schema->second.name) ||
                 std::ranges::find(named, channel.topic) != named.end()) {
        add(channel, schema->second, options);
      }
    }
  }
  if (topics_.empty()) throw ConfigError(fmt::format("{}: none of its topics is selected", name()));
  const auto unused = options.remap.unused({recorded.begin(), recorded.end()});
  if (!unused.empty()) {
    throw ConfigError(fmt::format("--remap '{}': {} has no such topic", unused[0], name()));
  }
  for (const std::string& topic : named) {
    if (!recorded.contains(topic)) notes_.push_back(fmt::format("{}: no topic {}", name(), topic));
  }
  for (const std::string& topic : foreign) {
    notes_.push_back(fmt::format("{}: topic {} is not Protobuf and not played", name(), topic));
  }
}

void Playback::add(const log::Channel& channel, const log::Schema& schema,
                   const PlaybackOptions& options) {
  const std::string topic = options.remap(channel.topic);
  const bool latched = is_latched(channel);
  auto same = std::ranges::find(topics_, topic, &PlayedTopic::topic);
  if (same == topics_.end()) {
    topics_.push_back({topic, schema.name, schema.data, latched});
    same = topics_.end() - 1;
  } else if (same->type != schema.name) {
    throw ConfigError(
        fmt::format("topic {} has two types in {}: {} and {}; --exclude one or --remap it", topic,
                    name(), same->type, schema.name));
  }
  same->latched = same->latched || latched;
  const std::string start_id = start_of(channel);
  const std::string publisher = channel.topic + '\n' + sender_of(channel) + '\n' + start_id;
  const auto index = publishers_.try_emplace(publisher, publishers_.size()).first->second;
  origins_[&channel] = {static_cast<std::size_t>(same - topics_.begin()), index, latched,
                        !start_id.empty()};
}

void Playback::find_range(const TimeRange& range) {
  const LogTimes times = resolve(range, span_);
  start_ns_ = std::max(times.start, span_.start_ns);
  end_ns_ = std::min(times.end, span_.end_ns);
  if (start_ns_ > end_ns_) {
    throw ConfigError(fmt::format("{}: nothing of its {:.3f} s lies between {:.3f} s and {:.3f} s",
                                  name(), position_s(span_.end_ns), position_s(start_ns_),
                                  position_s(end_ns_)));
  }
}

double Playback::position_s(std::uint64_t log_time_ns) const {
  return log_time_ns < span_.start_ns ? -static_cast<double>(span_.start_ns - log_time_ns) / kNsPerS
                                      : static_cast<double>(log_time_ns - span_.start_ns) / kNsPerS;
}

std::uint64_t Playback::log_time_ns(double position_s) const {
  const double s = std::clamp(position_s, 0.0, kLongest_s);
  return added(span_.start_ns, static_cast<std::uint64_t>(s * kNsPerS));
}

bool Playback::repeated(const Origin& origin, const log::Message& message) {
  if (!origin.latched || message.sequence == 0) return false;
  Last& last = last_[origin.publisher];
  const std::size_t hash = std::hash<std::string_view>()(message.data);
  // Without start ids a restarted publisher counts from 1 again: with another value, then.
  const bool again = last.sequence == message.sequence && (origin.told_apart || last.hash == hash);
  last = {message.sequence, hash};
  return again;
}

std::vector<PlayedValue> Playback::last_values(const std::set<std::size_t>& topics,
                                               std::uint64_t from_ns, std::uint64_t to_ns) {
  const auto wanted = [&](const log::Channel& channel) {
    const auto it = origins_.find(&channel);
    return it != origins_.end() && it->second.latched && topics.contains(it->second.topic);
  };
  log::MergedReader reader = merged(logs_, {wanted, from_ns, to_ns});
  std::map<std::size_t, std::pair<std::size_t, PlayedValue>> last;  // by topic: order, value
  std::size_t order = 0;
  while (const log::MergedReader::Item* item = reader.next()) {
    const Origin& origin = origins_.at(item->channel);
    const log::Message& m = *item->message;
    if (repeated(origin, m)) continue;
    last[origin.topic] = {
        order++, {&topics_[origin.topic], m.log_time, m.publish_time, std::string(m.data)}};
  }
  keep_damages(reader);
  std::map<std::size_t, PlayedValue> ordered;
  for (auto& [topic, value] : last) ordered.emplace(value.first, std::move(value.second));
  std::vector<PlayedValue> values;
  for (auto& [at, value] : ordered) values.push_back(std::move(value));
  return values;
}

std::vector<PlayedValue> Playback::seek(std::uint64_t log_time_ns) {
  const std::uint64_t target = std::max(log_time_ns, start_ns_);
  if (reader_) keep_damages(*reader_);
  last_.assign(publishers_.size(), {});
  std::set<std::size_t> missing;
  for (std::size_t i = 0; i < topics_.size(); ++i) {
    if (topics_[i].latched) missing.insert(i);
  }
  std::vector<PlayedValue> values;
  std::uint64_t look = kFirstLook;
  for (std::uint64_t to = target; !missing.empty() && to > span_.start_ns; look *= 4) {
    const std::uint64_t from = to - std::min(look, to - span_.start_ns);
    std::vector<PlayedValue> earlier = last_values(missing, from, to);
    for (const PlayedValue& value : earlier) {
      missing.erase(static_cast<std::size_t>(value.topic - topics_.data()));
    }
    values.insert(values.begin(), std::make_move_iterator(earlier.begin()),
                  std::make_move_iterator(earlier.end()));
    to = from;
  }
  const auto selected = [this](const log::Channel& channel) { return origins_.contains(&channel); };
  reader_ =
      std::make_unique<log::MergedReader>(merged(logs_, {selected, target, added(end_ns_, 1)}));
  return values;
}

bool Playback::next(Played& out) {
  while (const log::MergedReader::Item* item = reader_->next()) {
    const Origin& origin = origins_.at(item->channel);
    const log::Message& m = *item->message;
    if (repeated(origin, m)) continue;
    out = {&topics_[origin.topic], m.log_time, m.publish_time, m.data};
    return true;
  }
  return false;
}

void Playback::keep_damages(const log::MergedReader& reader) {
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    for (const log::Damage& d : reader.damages(i)) damages_.try_emplace({i, d.offset}, d.what);
  }
}

std::uint64_t Playback::report_damages() {
  if (reader_) keep_damages(*reader_);
  std::uint64_t total = 0;
  for (std::size_t i = 0; i < logs_.size(); ++i) {
    std::vector<log::Damage> found;
    for (const auto& [at, what] : damages_) {
      if (at.first == i) found.push_back({at.second, what});
    }
    const log::Summary& summary = logs_[i].summary;
    total += tool::report_damages(logs_[i].path, found,
                                  found.size() + summary.damage_count - summary.damages.size());
  }
  return total;
}

PlayAhead::PlayAhead(Playback& playback, PlayAheadLimits limits, std::function<void()> arrived)
    : playback_(playback),
      limits_(limits),
      arrived_(std::move(arrived)),
      seconds_(limits.seconds > 0.0 ? limits.seconds : kFirstSeconds) {}

PlayAhead::~PlayAhead() { stop(); }

void PlayAhead::stop() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
}

std::vector<PlayedValue> PlayAhead::seek(std::uint64_t log_time_ns) {
  stop();
  batches_.clear();
  bytes_ = 0;
  current_.messages.clear();
  next_ = 0;
  at_end_ = primed_ = full_ = false;
  std::vector<PlayedValue> latched = playback_.seek(log_time_ns);
  thread_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
  return latched;
}

void PlayAhead::read(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    Batch batch;
    {
      const std::lock_guard lock(mutex_);
      if (!spare_.empty()) {
        batch = std::move(spare_.back());
        spare_.pop_back();
      }
    }
    const bool more = fill(batch);
    std::unique_lock lock(mutex_);
    if (!batch.messages.empty()) {
      bytes_ += batch.bytes.size();
      batches_.push_back(std::move(batch));
    }
    at_end_ = !more;
    full_ = at_end_ || enough();
    if (std::exchange(awaited_, false) || full_) arrived_();
    if (at_end_) return;
    taken_.wait(lock, stop, [this] { return !enough(); });
    full_ = false;
  }
}

bool PlayAhead::fill(Batch& batch) {
  batch.bytes.clear();
  batch.messages.clear();
  batch.ends.clear();
  Played played;
  bool more = true;
  while (batch.bytes.size() < kBatchBytes && batch.messages.size() < kBatchMessages) {
    more = playback_.next(played);
    if (!more) break;
    batch.bytes.insert(batch.bytes.end(), played.payload.begin(), played.payload.end());
    batch.messages.push_back(played);
    batch.ends.push_back(batch.bytes.size());
  }
  std::size_t begin = 0;  // only now do the bytes stay where they are
  for (std::size_t i = 0; i < batch.messages.size(); ++i) {
    batch.messages[i].payload = {batch.bytes.data() + begin, batch.ends[i] - begin};
    begin = batch.ends[i];
  }
  return more;
}

bool PlayAhead::enough() const {
  if (batches_.empty()) return false;
  if (bytes_ >= limits_.bytes) return true;
  const std::uint64_t first = batches_.front().messages.front().log_time_ns;
  const std::uint64_t last = batches_.back().messages.back().log_time_ns;
  return static_cast<double>(last - first) * 1e-9 >= seconds_ * rate_;
}

const Played* PlayAhead::front() {
  if (next_ < current_.messages.size()) return &current_.messages[next_];
  const std::lock_guard lock(mutex_);
  if (batches_.empty()) {
    if (at_end_) return nullptr;
    if (primed_ && !awaited_ && limits_.seconds <= 0.0) {
      seconds_ = std::min(2.0 * seconds_, kMostSeconds);
    }
    awaited_ = true;
    return nullptr;
  }
  // Fresh memory costs more than a copy; as many as were ever ahead at once.
  if (!current_.messages.empty()) spare_.push_back(std::move(current_));
  current_ = std::move(batches_.front());
  batches_.pop_front();
  bytes_ -= current_.bytes.size();
  next_ = 0;
  primed_ = true;
  taken_.notify_one();
  return &current_.messages.front();
}

void PlayAhead::pop() { ++next_; }

bool PlayAhead::ended() {
  if (next_ < current_.messages.size()) return false;
  const std::lock_guard lock(mutex_);
  return at_end_ && batches_.empty();
}

bool PlayAhead::full() {
  const std::lock_guard lock(mutex_);
  return full_;
}

void PlayAhead::set_rate(double rate) {
  const std::lock_guard lock(mutex_);
  rate_ = rate;
  taken_.notify_one();
}

}  // namespace mimesis::tool
