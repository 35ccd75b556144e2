#include "tools/mimesis/log/record_file.h"

#include <fmt/format.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/error.h"
#include "tools/mimesis/log/human.h"

namespace mimesis::tool {
namespace {

constexpr std::uint64_t kPerMessage = 31;     // head of its record [bytes]
constexpr std::uint64_t kPerIndexEntry = 16;  // [bytes]
constexpr std::size_t kUnderWay = 3;          // chunks that the writer keeps before it waits

std::string name_of(const std::string& path) {
  return std::filesystem::path(path).filename().string();
}

}  // namespace

DiskSpace disk_space(const std::string& path) {
  struct statvfs info {};
  std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (folder.empty()) folder = ".";
  if (::statvfs(path.c_str(), &info) != 0 && ::statvfs(folder.c_str(), &info) != 0) return {};
  return {.free = std::uint64_t{info.f_bavail} * info.f_frsize,
          .size = std::uint64_t{info.f_blocks} * info.f_frsize};
}

std::string reached_limit(const DiskLimits& limits, std::uint64_t recorded, const DiskSpace& disk) {
  if (limits.max_size > 0 && recorded >= limits.max_size) {
    return fmt::format("the recording has reached --max-size {}", bytes_text(limits.max_size));
  }
  if (disk.size == 0) return {};
  const double percent = 100.0 * static_cast<double>(disk.free) / static_cast<double>(disk.size);
  if (disk.free < limits.min_free) {
    return fmt::format("{} are free on the disk, less than --min-free {}", bytes_text(disk.free),
                       bytes_text(limits.min_free));
  }
  if (percent < limits.min_free_percent) {
    return fmt::format("{:.1f} % of the disk are free, less than --min-free {}%", percent,
                       limits.min_free_percent);
  }
  return {};
}

void OwnFiles::set_size(std::uint64_t bytes) {
  total_ += bytes - files_.back().bytes;
  files_.back().bytes = bytes;
}

std::vector<std::string> OwnFiles::paths() const {
  std::vector<std::string> paths;
  for (const File& file : files_) paths.push_back(file.path);
  return paths;
}

std::string OwnFiles::take_oldest() {
  if (files_.size() < 2) return {};
  std::string path = std::move(files_.front().path);
  total_ -= files_.front().bytes;
  files_.pop_front();
  return path;
}

RecordFile::RecordFile(std::unique_ptr<log::Sink> sink, log::WriterOptions options,
                       Descriptors descriptors, std::chrono::nanoseconds sync)
    : sink_(std::move(sink)),
      writer_(*sink_, std::move(options)),
      descriptors_(std::move(descriptors)),
      sync_(sync) {}

log::Result RecordFile::write(const Recorded& message, WallTime now) {
  counts_.add(message);
  return put(message, message.log_time_ns, now);
}

log::Result RecordFile::repeat(const Recorded& message, std::uint64_t log_time_ns, WallTime now) {
  return put(message, log_time_ns, now);
}

log::Result RecordFile::put(const Recorded& message, std::uint64_t log_time_ns, WallTime now) {
  if (writer_.open_chunk_bytes() == 0) {
    chunk_opened_ = now;
    chunk_messages_ = 0;
  }
  const auto id = channel(message);
  if (!id) return tl::unexpected(id.error());
  ++chunk_messages_;
  const std::uint64_t bytes = writer_.open_chunk_bytes() + message.payload.size() + kPerMessage;
  auto done = writer_.write({*id, static_cast<std::uint32_t>(message.seq), log_time_ns,
                             message.publish_time_ns, message.payload});
  if (writer_.open_chunk_bytes() == 0) closed_chunk(bytes);
  return done;
}

log::Result RecordFile::advance(WallTime now) {
  if (writer_.open_chunk_bytes() > 0 && now >= chunk_opened_ + kChunkPeriod) {
    closed_chunk(writer_.open_chunk_bytes());
    if (auto done = writer_.flush(); !done) return done;
  }
  if (sync_.count() == 0 || now < synced_ + sync_) return {};
  synced_ = now;
  return writer_.sync();
}

void RecordFile::closed_chunk(std::uint64_t bytes) {
  under_way_.push_back(bytes + kPerIndexEntry * chunk_messages_);
  if (under_way_.size() > kUnderWay) under_way_.pop_front();
  chunk_messages_ = 0;
}

tl::expected<std::uint16_t, Status> RecordFile::channel(const Recorded& message) {
  std::tuple key{message.topic, message.node, message.type, message.start_id};
  if (const auto it = channels_.find(key); it != channels_.end()) return it->second;
  const std::size_t start = writer_.open_chunk_bytes();
  auto schema = schemas_.find(message.type);
  if (schema == schemas_.end()) {
    const auto id = writer_.add_schema(message.type, "protobuf", descriptors_(message.type));
    if (!id) return id;
    schema = schemas_.emplace(message.type, *id).first;
  }
  const std::size_t middle = writer_.open_chunk_bytes();
  const auto id = writer_.add_channel(schema->second, message.topic, "protobuf",
                                      {{"node", message.node},
                                       {"latched", message.latched ? "true" : "false"},
                                       {"type_hash", fmt::format("{:016x}", message.type_hash)},
                                       {"start_id", std::to_string(message.start_id)}});
  if (!id) return id;
  schema_bytes_ += middle - start;
  channel_bytes_ += writer_.open_chunk_bytes() - middle;
  channels_.emplace(std::move(key), *id);
  clocks_[message.node] = message.clock;
  return id;
}

std::uint64_t RecordFile::size_if_closed(std::size_t message) const {
  if (closed_) return writer_.bytes_written();
  // From above: payloads as if compression did nothing; the counts repeat the names of a channel
  // twice.
  constexpr std::uint64_t kFixed = 4096, kPerChunk = 256, kPerChannel = 160,
                          kPerChannelInChunk = 32;
  const std::uint64_t channels = channels_.size() + 1;
  const std::uint64_t chunks = writer_.statistics().chunk_count + 1;
  const std::uint64_t open = writer_.open_chunk_bytes() + kPerMessage + message +
                             kPerIndexEntry * (chunk_messages_ + 1) + kPerChannelInChunk * channels;
  std::uint64_t bytes = writer_.bytes_written() + open;
  for (const std::uint64_t chunk : under_way_) bytes += chunk + kPerChannelInChunk * channels;
  return bytes + chunks * (kPerChunk + 10 * channels) + schema_bytes_ + 3 * channel_bytes_ +
         kPerChannel * channels + kFixed;
}

log::Result RecordFile::finish() {
  if (auto done = writer_.add_metadata({"mimesis.counts", counts_.metadata()}); !done) return done;
  if (auto done = writer_.add_metadata({"mimesis.nodes", clocks_}); !done) return done;
  closed_ = true;
  return writer_.finish();
}

RecordHead::RecordHead(const std::vector<std::string>& attach_paths, Provenance provenance,
                       Options options)
    : provenance_(std::move(provenance)), options_(std::move(options)) {
  for (const std::string& path : attach_paths) {
    if (!attach(path)) throw ConfigError("--attach: cannot read '" + path + "'");
  }
  const std::string& launch_file = provenance_.launch_file;
  const bool given = std::ranges::find(attach_paths, launch_file) != attach_paths.end();
  if (!launch_file.empty() && !given) attach(launch_file);
}

bool RecordHead::attach(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream content;
  content << in.rdbuf();
  if (!in || in.bad()) return false;
  attached_.push_back({std::filesystem::path(path).filename().string(), content.str()});
  return true;
}

tl::expected<std::unique_ptr<RecordFile>, Status> RecordHead::open(const std::string& path) const {
  auto sink = log::create_file(path);
  if (!sink) return tl::unexpected(sink.error());
  auto file = std::make_unique<RecordFile>(std::move(*sink), options_.writer, options_.descriptors,
                                           options_.sync);
  log::Writer& writer = file->writer();
  const std::uint64_t time = std::stoull(provenance_.run.metadata.at("started_ns"));
  log::Result done = writer.add_metadata(provenance_.run);
  if (done && provenance_.launch) done = writer.add_metadata(*provenance_.launch);
  for (const Attached& attached : attached_) {
    const bool yaml = attached.name.ends_with(".yaml");
    if (done) {
      done = writer.attach({.log_time = time,
                            .create_time = time,
                            .name = attached.name,
                            .media_type = yaml ? "application/yaml" : "application/octet-stream",
                            .data = attached.data});
    }
  }
  if (!done) return tl::unexpected(done.error());
  return file;
}

std::string split_path(const std::string& output, std::uint64_t index) {
  const std::filesystem::path path(output);
  const std::string name =
      fmt::format("{}_{:03}{}", path.stem().string(), index, path.extension().string());
  return (path.parent_path() / name).string();
}

void remove_if_empty(const std::string& path) {
  std::error_code gone;
  if (std::filesystem::file_size(path, gone) == 0 && !gone) std::filesystem::remove(path, gone);
}

SplitLog::SplitLog(std::string output, SplitOptions options, OpenRecordFile open)
    : output_(std::move(output)), options_(options), open_(std::move(open)) {}

log::Result SplitLog::start() {
  const std::string path = options_.on() ? split_path(output_, 0) : output_;
  auto file = open(path);
  if (!file) return tl::unexpected(file.error());
  file_ = std::move(*file);
  files_.add(path);
  return {};
}

std::map<std::string, std::string> SplitLog::place(std::uint64_t index) const {
  return {{"index", std::to_string(index)},
          {"previous", index == 0 ? "" : name_of(split_path(output_, index - 1))}};
}

tl::expected<SplitLog::File, Status> SplitLog::open(const std::string& path) {
  auto file = open_(path);
  if (!file || !options_.on()) return file;
  const auto done = (*file)->writer().add_metadata({"mimesis.split", place(index_)});
  if (!done) return tl::unexpected(done.error());
  return file;
}

log::Result SplitLog::write(const Recorded& message, WallTime now) {
  if (due(message)) {
    if (auto done = next(message, now); !done) return done;
  }
  ++messages_;
  if (options_.on() && message.latched) latched_[{message.topic, message.node}] = message;
  return file_->write(message, now);
}

bool SplitLog::due(const Recorded& message) {
  if (!options_.on()) return false;
  if (message.ordered && !graph_time_) {
    graph_time_ = true;
    first_time_ns_.reset();
  }
  const bool has_time = message.ordered == graph_time_;
  if (has_time && !first_time_ns_) first_time_ns_ = message.log_time_ns;
  if (file_->counts().total.received == 0) return false;
  if (options_.size > 0 && file_->size_if_closed(message.payload.size()) > options_.size) {
    return true;
  }
  return options_.duration.count() > 0 && has_time &&
         message.log_time_ns >=
             *first_time_ns_ + static_cast<std::uint64_t>(options_.duration.count());
}

log::Result SplitLog::next(const Recorded& first, WallTime now) {
  ++index_;
  const std::string path = split_path(output_, index_);
  auto file = open(path);
  if (!file) {
    remove_if_empty(path);
    return tl::unexpected(file.error());
  }
  log::Result done;
  for (const auto& [key, message] : latched_) {
    const bool replaced = key == std::pair(first.topic, first.node);
    if (done && !replaced) done = (*file)->repeat(message, first.log_time_ns, now);
  }
  if (done) done = (*file)->writer().flush();
  if (done) done = close(*file_, name_of(path));
  files_.add(path);
  file_ = std::move(*file);
  first_time_ns_.reset();
  if (first.ordered == graph_time_) first_time_ns_ = first.log_time_ns;
  return done;
}

log::Result SplitLog::close(RecordFile& file, const std::string& next_path) {
  whole_.add(file.counts());
  log::Result done;
  if (options_.on()) {
    // Unless this is the last, the next one is open already.
    auto metadata = place(next_path.empty() ? index_ : index_ - 1);
    metadata["next"] = next_path;
    done = file.writer().add_metadata({"mimesis.split", std::move(metadata)});
    if (done) done = file.writer().add_metadata({"mimesis.counts.whole", whole_.metadata()});
  }
  if (done) done = file.finish();
  files_.set_size(file.writer().bytes_written());
  return done;
}

OwnFiles& SplitLog::files() {
  files_.set_size(file_->size_if_closed());
  return files_;
}

}  // namespace mimesis::tool
