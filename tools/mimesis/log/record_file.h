#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/log/io.h"
#include "common/log/writer.h"
#include "common/runtime/raw.h"
#include "common/time.h"
#include "tools/mimesis/log/elided_payload.h"
#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"

// A recording: messages on their way into it, and its files.
namespace mimesis::tool {

/// Why a recording cannot be written on. Ends the recording, not the program: its other files are
/// to be closed well.
class WriteFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// The result of writing. @throws WriteFailure
template <class T>
T written(tl::expected<T, Status> result) {
  if (!result) throw WriteFailure(result.error().reason);
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

/// A message on its way into a log.
struct Recorded {
  std::string topic, type;
  std::string node;   ///< that published it
  std::string clock;  ///< of that node: wall, sim or lockstep
  std::uint64_t type_hash = 0;
  bool latched = false;
  std::uint64_t start_id = 0;  ///< distinguishes a restarted node from its predecessor
  std::uint64_t seq = 0;
  std::uint64_t lost_before = 0;  ///< missing between the one before and this one
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  bool ordered = false;  ///< log_time is a time of the graph: equal ones are sorted by node
  bool elided = false;   ///< the payload is elide() what was published
  std::string payload;
};

using TopicAndNode = std::pair<std::string, std::string>;

/// Numbers of messages received and lost.
struct Counts {
  std::map<TopicAndNode, LossCount> topics;
  LossCount total;

  void add(const TopicAndNode& key, const LossCount& more) {
    for (LossCount* count : {&topics[key], &total}) {
      count->received += more.received;
      count->lost += more.lost;
    }
  }
  void add(const Recorded& m) { add({m.topic, m.node}, {1, m.lost_before}); }
  log::Metadata metadata(const std::string& name) const {
    LossCounts counts;
    for (const auto& [key, count] : topics) counts[key.first + " (" + key.second + ")"] = count;
    return losses_metadata(counts, name);
  }
};

using WallTime = std::chrono::steady_clock::time_point;

/// Takes messages as they arrive: leaves out repeated ones, counts gaps in seq, and hands them on
/// in an order that does not depend on their way here: those of one graph time sorted by node.
class Recording {
 public:
  using Output = std::function<void(Recorded message, WallTime now)>;

  /// Time that messages are held, until all of that graph time have arrived to be sorted.
  static constexpr std::chrono::milliseconds kHold{30};

  explicit Recording(Output output) : output_(std::move(output)) {}

  /// Takes a message received at `now`. `from_first`: its publisher started after the recorder, so
  /// that everything before its first message counts as lost.
  void add(Recorded message, WallTime now, bool from_first) {
    const auto [last, is_first] = last_.try_emplace({message.topic, message.node});
    const bool goes_on = !is_first && last->second.start_id == message.start_id;
    if (goes_on && message.seq <= last->second.seq) return;  // a latched message, repeated
    if (goes_on || from_first) {
      message.lost_before = message.seq - (goes_on ? last->second.seq : 0) - 1;
    }
    last->second = {message.start_id, message.seq};
    counts_.add(message);
    if (!message.ordered) return output_(std::move(message), now);
    std::pair key{message.log_time_ns, message.node};
    held_.emplace(std::move(key), Held{std::move(message), now});
  }
  /// Passes on messages that were held long enough.
  void advance(WallTime now) {
    // The first one held is the earliest of the graph, not the first to have come: it alone
    // decides.
    while (!held_.empty() && held_.begin()->second.received + kHold <= now) release(now);
  }
  /// Hands on everything that is held.
  void finish(WallTime now) {
    while (!held_.empty()) release(now);
  }

  const Counts& counts() const { return counts_; }

 private:
  struct Held {
    Recorded message;
    WallTime received;
  };
  struct Last {
    std::uint64_t start_id = 0, seq = 0;
  };
  void release(WallTime now) {
    output_(std::move(held_.extract(held_.begin()).mapped().message), now);
  }

  Output output_;
  Counts counts_;
  std::map<TopicAndNode, Last> last_;
  std::multimap<std::pair<std::uint64_t, std::string>, Held> held_;  ///< by log time and node
};

/// Space that a recording may take. 0: no limit.
struct DiskLimits {
  std::uint64_t max_size = 0;     ///< largest size of all files of the recording [bytes]
  std::uint64_t min_free = 0;     ///< on the disk [bytes]
  double min_free_percent = 0.0;  ///< least free share of the disk [%]
  bool delete_oldest = false;     ///< when full: the recording's own oldest file; else stop

  bool any() const { return max_size > 0 || min_free > 0 || min_free_percent > 0.0; }
};

/// Space on the disk that holds a file [bytes]. `path` or its folder must exist; all zero if the
/// system does not report it.
inline std::filesystem::space_info disk_space(const std::filesystem::path& path) {
  std::error_code error;
  auto space = std::filesystem::space(path, error);
  if (error) space = std::filesystem::space(std::filesystem::absolute(path).parent_path(), error);
  return error ? std::filesystem::space_info{} : space;
}

/// The limit that is reached, in words with its figures; empty if none is.
/// @param recorded  size of the recording once its open file is closed [bytes]
inline std::string reached_limit(const DiskLimits& limits, std::uint64_t recorded,
                                 const std::filesystem::space_info& disk) {
  if (limits.max_size > 0 && recorded >= limits.max_size) {
    return fmt::format("the recording has reached --max-size {}", bytes_text(limits.max_size));
  }
  if (disk.capacity == 0) return {};
  if (disk.available < limits.min_free) {
    return fmt::format("{} are free on the disk, less than --min-free {}",
                       bytes_text(disk.available), bytes_text(limits.min_free));
  }
  const double percent =
      100.0 * static_cast<double>(disk.available) / static_cast<double>(disk.capacity);
  if (percent >= limits.min_free_percent) return {};
  return fmt::format("{:.1f} % of the disk are free, less than --min-free {}%", percent,
                     limits.min_free_percent);
}

/// The files of one recording, oldest first. The last may be open.
class OwnFiles {
 public:
  void add(std::string path) { files_.push_back({std::move(path), 0}); }
  /// Size of the last file, or of the one `before` it [bytes].
  void set_size(std::uint64_t bytes, std::size_t before = 0) {
    File& file = files_[files_.size() - 1 - before];
    total_ += bytes - file.bytes;
    file.bytes = bytes;
  }
  std::uint64_t total() const { return total_; }
  const std::string& last() const { return files_.back().path; }
  std::vector<std::string> paths() const {
    std::vector<std::string> paths;
    for (const File& file : files_) paths.push_back(file.path);
    return paths;
  }
  /// Takes the oldest out of the list; empty if that is the last, which is being written.
  std::string take_oldest() {
    if (files_.size() < 2) return {};
    File oldest = std::move(files_.front());
    files_.pop_front();
    total_ -= oldest.bytes;
    return oldest.path;
  }

 private:
  struct File {
    std::string path;
    std::uint64_t bytes;
  };
  std::deque<File> files_;
  std::uint64_t total_ = 0;
};

/// One file of a recording, whole in itself: a channel per topic, node and start of the node,
/// chunks closed by size and by time, counts of its contents. All calls that write throw
/// WriteFailure.
class RecordFile {
 public:
  struct Options {
    log::WriterOptions writer;
    /// Serialised FileDescriptorSet of the type with a hash.
    std::function<std::string(std::uint64_t type_hash)> descriptors;
    /// Everything is brought to the disk so often, against power cuts; 0: never.
    std::chrono::nanoseconds sync{0};
  };

  /// Longest time of a message in an open chunk; a killed recorder loses as much.
  static constexpr std::chrono::milliseconds kChunkPeriod{40};

  RecordFile(std::unique_ptr<log::Sink> sink, Options options)
      : options_(std::move(options)), sink_(std::move(sink)), writer_(*sink_, options_.writer) {}

  void write(const Recorded& message, WallTime now) {
    counts_.add(message);
    repeat(message, message.log_time_ns, now);
  }
  /// A latched message of an earlier file, at another log time; not counted.
  void repeat(const Recorded& message, std::uint64_t log_time_ns, WallTime now) {
    if (writer_.open_chunk_bytes() == 0) {
      chunk_opened_ = now;
      chunk_messages_ = 0;
    }
    const std::uint16_t id = channel(message);
    ++chunk_messages_;
    const std::uint64_t bytes = writer_.open_chunk_bytes() + message.payload.size() + kPerMessage;
    const auto done = writer_.write({id, static_cast<std::uint32_t>(message.seq), log_time_ns,
                                     message.publish_time_ns, message.payload});
    if (writer_.open_chunk_bytes() == 0) closed_chunk(bytes);
    written(done);
  }
  /// Closes a chunk that was open long enough, and syncs.
  void advance(WallTime now) {
    if (writer_.open_chunk_bytes() > 0 && now >= chunk_opened_ + kChunkPeriod) {
      closed_chunk(writer_.open_chunk_bytes());
      written(writer_.flush());
    }
    if (options_.sync.count() == 0 || now < synced_ + options_.sync) return;
    synced_ = now;
    written(writer_.sync());
  }
  void add_metadata(const log::Metadata& metadata) { written(writer_.add_metadata(metadata)); }
  /// Writes metadata "mimesis.counts" and "mimesis.nodes" (name -> clock) and closes the file.
  void finish() {
    add_metadata(counts_.metadata(kCountsName));
    add_metadata({"mimesis.nodes", clocks_});
    closed_ = true;
    written(writer_.finish());
  }

  log::Writer& writer() { return writer_; }
  const Counts& counts() const { return counts_; }
  /// The size; of an open file from above, as if it were closed now with `message` more [bytes].
  std::uint64_t size_if_closed(std::size_t message = 0) const {
    if (closed_) return writer_.bytes_written();
    // From above: payloads as if compression did nothing; the counts repeat the names of a channel
    // twice.
    constexpr std::uint64_t kFixed = 4096, kPerChunk = 256, kPerChannel = 160,
                            kPerChannelInChunk = 32;
    const std::uint64_t channels = channels_.size() + 1;
    const std::uint64_t chunks = writer_.statistics().chunk_count + 1;
    const std::uint64_t open = writer_.open_chunk_bytes() + kPerMessage + message +
                               kPerIndexEntry * (chunk_messages_ + 1) +
                               kPerChannelInChunk * channels;
    std::uint64_t bytes = writer_.bytes_written() + open;
    for (const std::uint64_t chunk : under_way_) bytes += chunk + kPerChannelInChunk * channels;
    return bytes + chunks * (kPerChunk + 10 * channels) + schema_bytes_ + 3 * channel_bytes_ +
           kPerChannel * channels + kFixed;
  }

 private:
  static constexpr std::uint64_t kPerMessage = 31;     ///< head of its record [bytes]
  static constexpr std::uint64_t kPerIndexEntry = 16;  ///< [bytes]
  static constexpr std::size_t kUnderWay = 3;  ///< chunks that the writer keeps before it waits

  std::uint16_t channel(const Recorded& message) {
    std::tuple key{message.topic, message.node, message.type, message.start_id, message.elided};
    if (const auto it = channels_.find(key); it != channels_.end()) return it->second;
    const std::size_t start = writer_.open_chunk_bytes();
    auto schema = schemas_.find({message.type, message.type_hash});
    if (schema == schemas_.end()) {
      const auto id = written(
          writer_.add_schema(message.type, "protobuf", options_.descriptors(message.type_hash)));
      schema = schemas_.emplace(std::pair(message.type, message.type_hash), id).first;
    }
    const std::size_t middle = writer_.open_chunk_bytes();
    std::map<std::string, std::string> metadata{
        {"node", message.node},
        {"latched", message.latched ? "true" : "false"},
        {"type_hash", fmt::format("{:016x}", message.type_hash)},
        {"start_id", std::to_string(message.start_id)}};
    if (message.elided) metadata[kElidedKey] = "mimesis log restore";
    const auto id = written(
        writer_.add_channel(schema->second, message.topic, "protobuf", std::move(metadata)));
    schema_bytes_ += middle - start;
    channel_bytes_ += writer_.open_chunk_bytes() - middle;
    channels_.emplace(std::move(key), id);
    clocks_[message.node] = message.clock;
    return id;
  }
  void closed_chunk(std::uint64_t bytes) {
    under_way_.push_back(bytes + kPerIndexEntry * chunk_messages_);
    if (under_way_.size() > kUnderWay) under_way_.pop_front();
    chunk_messages_ = 0;
  }

  Options options_;
  std::unique_ptr<log::Sink> sink_;
  log::Writer writer_;
  std::map<std::pair<std::string, std::uint64_t>, std::uint16_t> schemas_;  ///< by type and hash
  /// By topic, node, type, start, and whether they are elided.
  std::map<std::tuple<std::string, std::string, std::string, std::uint64_t, bool>, std::uint16_t>
      channels_;
  std::uint64_t schema_bytes_ = 0, channel_bytes_ = 0;  ///< the summary repeats them
  std::uint64_t chunk_messages_ = 0;                    ///< in the open chunk
  std::deque<std::uint64_t> under_way_;  ///< sizes of closed chunks that may not be written yet
  std::map<std::string, std::string> clocks_;  ///< clocks of nodes
  Counts counts_;
  WallTime chunk_opened_{}, synced_{};
  bool closed_ = false;
};

/// Makes a new file; it knows where the head of every file comes from. @throws WriteFailure
using OpenRecordFile = std::function<std::unique_ptr<RecordFile>(const std::string& path)>;

/// Files that begin with provenance and attachments, written through: a disk that is full already
/// is reported. Launch files of `provenance` may be missing (they are on another host).
/// @throws ConfigError if a file of `attach` cannot be read.
inline OpenRecordFile with_head(std::vector<std::string> attach, Provenance provenance,
                                RecordFile::Options options) {
  struct Attached {
    std::string name, data;
  };
  std::vector<Attached> attached;
  const std::vector<std::string> given = attach;
  for (const std::string& file : provenance.launch_files) {
    if (std::ranges::find(given, file) == given.end()) attach.push_back(file);
  }
  for (const std::string& path : attach) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream content;
    content << in.rdbuf();
    if (in && !in.bad()) {
      attached.push_back({std::filesystem::path(path).filename().string(), content.str()});
    } else if (std::ranges::find(given, path) != given.end()) {
      throw ConfigError("--attach: cannot read '" + path + "'");
    }
  }
  return [attached = std::move(attached), provenance = std::move(provenance),
          options = std::move(options)](const std::string& path) {
    auto file = std::make_unique<RecordFile>(written(log::create_file(path)), options);
    log::Writer& writer = file->writer();
    written(writer.add_metadata(provenance.run));
    if (provenance.launch) written(writer.add_metadata(*provenance.launch));
    const std::uint64_t time = std::stoull(provenance.run.metadata.at("started_ns"));
    for (const auto& [name, data] : attached) {
      const bool yaml = name.ends_with(".yaml");
      written(writer.attach({.log_time = time,
                             .create_time = time,
                             .name = name,
                             .media_type = yaml ? "application/yaml" : "application/octet-stream",
                             .data = data}));
    }
    return file;
  };
}

inline void remove_if_empty(const std::string& path) {
  std::error_code gone;
  if (std::filesystem::file_size(path, gone) == 0 && !gone) std::filesystem::remove(path, gone);
}

/// Limits at which the next file begins. 0: no limit.
struct SplitOptions {
  std::uint64_t size = 0;                ///< no file becomes larger [bytes]
  std::chrono::nanoseconds duration{0};  ///< length in log time
  bool on() const { return size > 0 || duration.count() > 0; }
};

/// A recording in one file, or in files NAME_000, NAME_001... that follow each other without loss
/// or repetition: the next is open before the last is closed. Each is whole in itself; latched
/// topics begin with the value they had, at the log time of the first message and with its own seq.
/// Metadata "mimesis.split": index, previous and (once it is closed) next file, empty for the last;
/// of several such records the last one counts. "mimesis.counts" is that of the file,
/// "mimesis.counts.whole" that of the recording up to its end. All calls that write throw
/// WriteFailure.
class SplitLog {
 public:
  /// Opens the first file: the output itself if there is no reason to split.
  SplitLog(std::string output, SplitOptions options, OpenRecordFile open)
      : output_(std::move(output)), options_(options), open_(std::move(open)) {
    files_.add(options_.on() ? path(0) : output_);
    file_ = open_(files_.last());
    if (options_.on()) file_->add_metadata({"mimesis.split", neighbours(0)});
  }

  void write(const Recorded& message, WallTime now) {
    if (due(message)) next(message, now);
    ++messages_;
    if (options_.on() && message.latched) latched_[{message.topic, message.node}] = message;
    file_->write(message, now);
  }
  void advance(WallTime now) { file_->advance(now); }
  void finish(WallTime /*now*/) {
    close(*file_, index_, "");
    files_.set_size(file_->writer().bytes_written());
  }

  /// With their sizes, the open one's as if it were closed now.
  OwnFiles& files() {
    files_.set_size(file_->size_if_closed());
    return files_;
  }
  std::uint64_t messages() const { return messages_; }  ///< written, without repeated ones
  /// The file being written, for people.
  std::string place() const { return files_.last(); }

 private:
  std::string path(std::uint64_t index) const {
    const std::filesystem::path path(output_);
    return path.parent_path() /
           fmt::format("{}_{:03}{}", path.stem().string(), index, path.extension().string());
  }
  std::string name(std::uint64_t index) const {
    return std::filesystem::path(path(index)).filename();
  }
  /// Metadata that place file `index` among the others.
  std::map<std::string, std::string> neighbours(std::uint64_t index) const {
    return {{"index", std::to_string(index)}, {"previous", index == 0 ? "" : name(index - 1)}};
  }
  bool due(const Recorded& message) {
    if (!options_.on()) return false;
    if (message.ordered && !graph_time_) {
      graph_time_ = true;
      first_time_ns_.reset();
    }
    const bool has_time = message.ordered == graph_time_;
    if (has_time && !first_time_ns_) first_time_ns_ = message.log_time_ns;
    if (file_->counts().total.received == 0) return false;
    const auto duration_ns = static_cast<std::uint64_t>(options_.duration.count());
    return (options_.size > 0 && file_->size_if_closed(message.payload.size()) > options_.size) ||
           (duration_ns > 0 && has_time && message.log_time_ns >= *first_time_ns_ + duration_ns);
  }
  void next(const Recorded& first, WallTime now) {
    const std::string next_path = path(index_ + 1);
    std::unique_ptr<RecordFile> file;
    try {
      file = open_(next_path);
      file->add_metadata({"mimesis.split", neighbours(index_ + 1)});
    } catch (const WriteFailure&) {
      file.reset();
      remove_if_empty(next_path);
      throw;
    }
    std::swap(file, file_);  // `file` is the last one: after a failure it stays as it is
    files_.add(next_path);
    ++index_;
    for (const auto& [key, message] : latched_) {
      if (key != std::pair(first.topic, first.node)) file_->repeat(message, first.log_time_ns, now);
    }
    written(file_->writer().flush());
    close(*file, index_ - 1, name(index_));
    files_.set_size(file->writer().bytes_written(), 1);
    first_time_ns_.reset();
    if (first.ordered == graph_time_) first_time_ns_ = first.log_time_ns;
  }
  void close(RecordFile& file, std::uint64_t index, const std::string& next_name) {
    for (const auto& [key, count] : file.counts().topics) whole_.add(key, count);
    if (options_.on()) {
      auto metadata = neighbours(index);
      metadata["next"] = next_name;
      file.add_metadata({"mimesis.split", std::move(metadata)});
      file.add_metadata(whole_.metadata("mimesis.counts.whole"));
    }
    file.finish();
  }

  std::string output_;
  SplitOptions options_;
  OpenRecordFile open_;
  std::unique_ptr<RecordFile> file_;
  OwnFiles files_;
  std::uint64_t index_ = 0, messages_ = 0;
  Counts whole_;  ///< counts of the files that are closed
  /// Last value of each latched topic; kept only if there may be a next file.
  std::map<TopicAndNode, Recorded> latched_;
  bool graph_time_ = false;  ///< a message with a time of the graph was there: only these split
  std::optional<std::uint64_t> first_time_ns_;  ///< log time at which this file began
};

// A recorder watches its own end, publishers that are silent, and how the recording stands.

/// Decides when to stop listening after the signal to stop: when no message published before it has
/// come for a while, even if the graph continues to publish.
class Drain {
 public:
  /// After this time without an old message no more are expected.
  static constexpr std::chrono::milliseconds kQuiet{100};
  /// Publishers that are further behind are not waited for.
  static constexpr std::chrono::seconds kAtMost{2};

  /// Begins at the signal.
  Drain(WallTime now, std::uint64_t wall_ns) : begin_(now), last_old_(now), wall_ns_(wall_ns) {}

  /// A message has come. `graph_time`: `time_ns` is a simulated time, else that of the wall clock.
  void received(WallTime now, bool graph_time, std::uint64_t time_ns) {
    // Simulated time at the signal is unknown: messages right behind it are counted in.
    if (graph_time && now - begin_ < kQuiet) graph_ns_ = std::max(graph_ns_, time_ns);
    const bool unknown = !graph_time && time_ns == 0;
    if (!unknown && time_ns <= (graph_time ? graph_ns_ : wall_ns_)) last_old_ = now;
  }
  bool over(WallTime now) const { return now - last_old_ >= kQuiet || now - begin_ >= kAtMost; }
  /// It is over because of kAtMost: what else was published before the signal is unknown.
  bool gave_up(WallTime now) const { return now - last_old_ < kQuiet; }

 private:
  WallTime begin_, last_old_;
  std::uint64_t wall_ns_;
  std::uint64_t graph_ns_ = 0;  ///< the latest simulated time that began before or with the signal
};

/// Finds topics that have a publisher but bring no message.
class SilenceWatch {
 public:
  /// Longest silence in the publisher's own time: a graph that waits for its last node, or that is
  /// simulated slowly, is not silent.
  static constexpr std::chrono::seconds kPatience{2};

  /// Now on the wall's clock and on the graph's; the latter 0 until it runs.
  struct Now {
    std::chrono::nanoseconds wall, graph;
  };

  /// A publisher is there and ready; the first call in a running graph counts.
  void met(const std::string& topic, const std::string& node, bool graph_time, const Now& now) {
    if (graph_time && now.graph.count() == 0) return;
    met_.try_emplace({topic, node}, Met{graph_time, graph_time ? now.graph : now.wall, false});
  }
  /// "TOPIC (NODE)" of those that have been silent for too long, each once.
  std::vector<std::string> silent(const Counts& counts, const Now& now) {
    std::vector<std::string> topics;
    for (auto& [key, met] : met_) {
      if (met.settled || (met.graph_time ? now.graph : now.wall) < met.since + kPatience) continue;
      met.settled = true;
      if (!counts.topics.contains(key)) topics.push_back(key.first + " (" + key.second + ")");
    }
    return topics;
  }

 private:
  struct Met {
    bool graph_time;
    std::chrono::nanoseconds since;
    bool settled;  ///< reported as silent, or received
  };
  std::map<TopicAndNode, Met> met_;
};

/// How a recording stands.
struct RecordState {
  const Counts& counts;
  std::string file;              ///< file being written, or another state
  std::uint64_t bytes = 0;       ///< size of all files of the recording
  std::uint64_t free_bytes = 0;  ///< on the disk
};

/// A line that says how a recording stands, now and then.
class CountsLine {
 public:
  explicit CountsLine(WallTime start) : shown_(start) {}

  void show(const RecordState& state, WallTime now) {
    const LossCount& total = state.counts.total;
    const auto fresh = static_cast<double>(total.received - received_);
    if (!line_.show(fmt::format("{}: {} messages ({:.0f}/s), {} lost, {}, {} free", state.file,
                                total.received, fresh / to_seconds(now - shown_), total.lost,
                                bytes_text(state.bytes), bytes_text(state.free_bytes)),
                    now)) {
      return;
    }
    shown_ = now;
    received_ = total.received;
  }
  /// Takes the line away: before other lines are printed, and at the end.
  void clear() { line_.clear(); }

 private:
  StatusLine line_;
  WallTime shown_;
  std::uint64_t received_ = 0;  ///< when last shown
};

}  // namespace mimesis::tool
