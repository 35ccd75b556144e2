#include "common/log/writer.h"

#include <atomic>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <queue>
#include <thread>

#include "common/log/codec.h"

namespace mimesis::log {
namespace {
constexpr std::size_t kMaxIds = std::numeric_limits<std::uint16_t>::max();
}

/// The file as it grows: compresses, sums, writes and remembers where things stand. Used by one
/// thread at a time; `position` by any. A failure is final: all later calls return it.
class FileBody {
 public:
  FileBody(Sink& sink, const WriterOptions& options)
      : sink_(sink), options_(options), compressor_(options.compression, options.zstd_level) {
    append(record_, Header{options.profile, options.library});
    record_.insert(0, kMagic);
    status_ = emit(record_);
  }

  Result record(std::string_view bytes) { return emit(bytes); }
  Result chunk(ChunkBuffer& closed) {
    if (!status_) return status_;
    const auto compressed = compressor_.run(closed.records);
    if (!compressed) return status_ = tl::unexpected(compressed.error());
    const std::uint32_t crc = crc32(0, closed.records);
    const Chunk head{closed.start_time,
                     closed.end_time,
                     closed.records.size(),
                     crc,
                     std::string(wire_name(options_.compression)),
                     *compressed};
    ChunkIndex index{.message_start_time = closed.start_time,
                     .message_end_time = closed.end_time,
                     .chunk_start_offset = position(),
                     .chunk_length = 0,
                     .message_index_offsets = {},
                     .message_index_length = 0,
                     .compression = head.compression,
                     .compressed_size = compressed->size(),
                     .uncompressed_size = closed.records.size()};
    record_.clear();
    append_head(record_, head);
    if (auto done = emit(record_); !done) return done;
    const bool as_is = options_.compression == Compression::none;
    if (auto done = emit(*compressed, as_is ? crc : crc32(0, *compressed)); !done) return done;
    index.chunk_length = position() - index.chunk_start_offset;

    record_.clear();
    for (std::size_t id = 0; id < closed.messages.size(); ++id) {
      MessageIndex& messages = closed.messages[id];
      if (messages.records.empty()) continue;
      messages.channel_id = static_cast<std::uint16_t>(id);
      index.message_index_offsets[messages.channel_id] = position() + record_.size();
      append(record_, messages);
    }
    index.message_index_length = record_.size();
    if (auto done = emit(record_); !done) return done;
    append(chunk_indexes_, index);
    return status_;
  }
  Result attachment(const Attachment& attachment) {
    AttachmentIndex index{position(),
                          0,
                          attachment.log_time,
                          attachment.create_time,
                          attachment.data.size(),
                          attachment.name,
                          attachment.media_type};
    record_.clear();
    append_head(record_, attachment);
    const std::uint32_t head_crc = crc32(0, std::string_view(record_).substr(kRecordHead));
    const std::uint32_t data_crc = crc32(0, attachment.data);
    const std::uint32_t crc = crc32_join(head_crc, data_crc, attachment.data.size());
    if (auto done = emit(record_); !done) return done;
    if (auto done = emit(attachment.data, data_crc); !done) return done;
    if (auto done = emit({reinterpret_cast<const char*>(&crc), sizeof crc}); !done) return done;
    index.length = position() - index.offset;
    attachment_indexes_.push_back(std::move(index));
    return status_;
  }
  Result metadata(const Metadata& metadata) {
    record_.clear();
    append(record_, metadata);
    metadata_indexes_.push_back({position(), record_.size(), metadata.name});
    return emit(record_);
  }
  Result flush() {
    if (!status_) return status_;
    return status_ = sink_.flush();
  }
  Result sync() {
    if (!status_) return status_;
    return status_ = sink_.sync();
  }
  /// Ends the data, writes the summary and closes the sink.
  Result finish(const std::vector<Schema>& schemas, const std::vector<Channel>& channels,
                const Statistics& statistics) {
    record_.clear();
    append(record_, DataEnd{crc_});
    if (auto done = emit(record_); !done) return done;
    if (auto done = write_summary(schemas, channels, statistics); !done) return done;
    return status_ = sink_.close();
  }

  std::uint64_t position() const { return position_.load(std::memory_order_relaxed); }
  const Result& status() const { return status_; }

 private:
  Result emit(std::string_view bytes) { return emit(bytes, crc32(0, bytes)); }
  Result emit(std::string_view bytes, std::uint32_t crc_of_bytes) {
    if (!status_) return status_;
    crc_ = crc32_join(crc_, crc_of_bytes, bytes.size());
    position_.store(position() + bytes.size(), std::memory_order_relaxed);
    return status_ = sink_.write(bytes);
  }
  Result write_summary(const std::vector<Schema>& schemas, const std::vector<Channel>& channels,
                       const Statistics& statistics) {
    crc_ = 0;
    const std::uint64_t start = position();
    std::vector<SummaryOffset> groups;
    const auto group = [&](Opcode opcode, bool wanted, const auto& records) {
      if (!wanted || records.empty()) return;
      record_.clear();
      for (const auto& r : records) append(record_, r);
      groups.push_back({opcode, position(), record_.size()});
      static_cast<void>(emit(record_));  // status_ keeps a failure
    };
    // The order of the reference writer.
    group(Opcode::schema, options_.repeat_schemas, schemas);
    group(Opcode::channel, options_.repeat_channels, channels);
    group(Opcode::statistics, options_.statistics, std::vector{statistics});
    group(Opcode::metadata_index, options_.metadata_index, metadata_indexes_);
    group(Opcode::attachment_index, options_.attachment_index, attachment_indexes_);
    if (options_.chunk_index && chunk_indexes_.size() > 0) {
      groups.push_back({Opcode::chunk_index, position(), chunk_indexes_.size()});
      static_cast<void>(emit(chunk_indexes_));
    }

    Footer footer{};
    if (position() > start) footer.summary_start = start;
    record_.clear();
    if (options_.summary_offsets && !groups.empty()) {
      footer.summary_offset_start = position();
      for (const SummaryOffset& g : groups) append(record_, g);
    }
    append(record_, footer);
    const std::size_t covered = record_.size() - sizeof footer.summary_crc;
    footer.summary_crc = crc32(crc_, std::string_view(record_).substr(0, covered));
    record_.resize(covered);
    record_.append(reinterpret_cast<const char*>(&footer.summary_crc), sizeof footer.summary_crc);
    record_.append(kMagic);
    return emit(record_);
  }

  Sink& sink_;
  const WriterOptions& options_;
  Compressor compressor_;
  Result status_;
  std::atomic<std::uint64_t> position_ = 0;
  std::uint32_t crc_ = 0;  ///< sum of all bytes so far; of the summary's bytes once it has begun
  std::string record_;     ///< scratch

  std::string chunk_indexes_;  ///< records: some 100 bytes a chunk
  std::vector<AttachmentIndex> attachment_indexes_;
  std::vector<MetadataIndex> metadata_indexes_;
};

/// Writes closed chunks into the file on a thread of its own, in the order they are handed over. At
/// most kInFlight are pending: then the caller waits. Their memory is reused.
class ChunkWorker {
 public:
  static constexpr std::size_t kInFlight = 3;

  explicit ChunkWorker(FileBody& body) : body_(body), status_(body.status()), failed_(!status_) {
    for (std::size_t i = 0; i < kInFlight; ++i) spare_.push_back(std::make_unique<ChunkBuffer>());
    thread_ = std::thread([this] { run(); });
  }
  /// Everything handed over is written before.
  ~ChunkWorker() {
    {
      const std::scoped_lock lock(mutex_);
      stopping_ = true;
    }
    to_do_.notify_one();
    thread_.join();
  }

  /// Takes the chunk (nothing, if it is empty) and gives back a cleared one. `flush`: the data so
  /// far is handed to the operating system as soon as it is written. Returns errors of earlier
  /// chunks.
  Result put(ChunkBuffer& chunk, bool flush) {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return jobs_.size() < kInFlight; });
    if (!status_) return status_;
    std::unique_ptr<ChunkBuffer> taken;
    if (!chunk.records.empty()) {
      taken = std::move(spare_.back());
      spare_.pop_back();
      std::swap(*taken, chunk);
    }
    jobs_.push({std::move(taken), flush});
    lock.unlock();
    to_do_.notify_one();
    return {};
  }
  /// Waits until all is written; the body is the caller's until the next `put`.
  Result wait() {
    std::unique_lock lock(mutex_);
    done_.wait(lock, [this] { return jobs_.empty(); });
    return status_;
  }
  /// The first failure so far.
  Result status() {
    if (!failed_.load(std::memory_order_relaxed)) return {};
    const std::scoped_lock lock(mutex_);
    return status_;
  }

 private:
  struct Job {
    std::unique_ptr<ChunkBuffer> chunk;
    bool flush;
  };
  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      to_do_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      Job& job = jobs_.front();
      lock.unlock();
      Result done;
      if (job.chunk) {
        done = body_.chunk(*job.chunk);
        job.chunk->clear();
      }
      if (done && job.flush) done = body_.flush();
      lock.lock();
      if (job.chunk) spare_.push_back(std::move(job.chunk));
      jobs_.pop();
      if (!done) {
        status_ = done;
        failed_.store(true, std::memory_order_relaxed);
      }
      done_.notify_one();
    }
  }

  FileBody& body_;
  std::mutex mutex_;
  std::condition_variable to_do_, done_;
  std::queue<Job> jobs_;  ///< the first one is in work
  std::vector<std::unique_ptr<ChunkBuffer>> spare_;
  bool stopping_ = false;
  Result status_;  ///< copy of the body's
  std::atomic<bool> failed_ = false;
  std::thread thread_;
};

Writer::Writer(Sink& sink, WriterOptions options)
    : options_(std::move(options)), body_(std::make_unique<FileBody>(sink, options_)) {
  if (options_.background && chunked()) worker_ = std::make_unique<ChunkWorker>(*body_);
}

Writer::~Writer() = default;

std::uint64_t Writer::bytes_written() const { return body_->position(); }

Result Writer::status() { return worker_ ? worker_->status() : body_->status(); }

/// A definition: into the open chunk, or directly into the file.
template <class T>
Result Writer::add(const T& record) {
  if (auto done = status(); !done) return done;
  if (chunked()) {
    append(chunk_.records, record);
    return {};
  }
  record_.clear();
  append(record_, record);
  return body_->record(record_);
}

tl::expected<std::uint16_t, Status> Writer::add_schema(std::string name, std::string encoding,
                                                       std::string data) {
  if (schemas_.size() == kMaxIds)
    return tl::unexpected(Status{"a log holds at most 65535 schemas"});
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schemas_.push_back({id, std::move(name), std::move(encoding), std::move(data)});
  ++statistics_.schema_count;
  if (auto done = add(schemas_.back()); !done) return tl::unexpected(done.error());
  return id;
}

tl::expected<std::uint16_t, Status> Writer::add_channel(
    std::uint16_t schema_id, std::string topic, std::string message_encoding,
    std::map<std::string, std::string> metadata) {
  MIMESIS_ASSERT(schema_id <= schemas_.size());
  if (channels_.size() == kMaxIds)
    return tl::unexpected(Status{"a log holds at most 65535 channels"});
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  channels_.push_back(
      {id, schema_id, std::move(topic), std::move(message_encoding), std::move(metadata)});
  channel_counts_.resize(id + 1u, nullptr);
  ++statistics_.channel_count;
  if (auto done = add(channels_.back()); !done) return tl::unexpected(done.error());
  return id;
}

Result Writer::write(const Message& message) {
  MIMESIS_ASSERT(message.channel_id >= 1 && message.channel_id <= channels_.size());
  if (auto done = status(); !done) return done;
  count(message);
  if (!chunked()) {
    record_.clear();
    append(record_, message);
    return body_->record(record_);
  }
  chunk_.add(message, options_.message_index);
  return chunk_.records.size() >= options_.chunk_size ? close_chunk(true) : Result{};
}

void Writer::count(const Message& message) {
  std::uint64_t*& of_channel = channel_counts_[message.channel_id];
  if (of_channel == nullptr) {
    of_channel = &statistics_.channel_message_counts[message.channel_id];
  }
  statistics_.count(message.log_time);
  ++*of_channel;
}

Result Writer::close_chunk(bool flush) {
  const bool empty = chunk_.records.empty();
  if (empty && (!flush || flushed_)) return status();
  if (!empty) ++statistics_.chunk_count;
  flushed_ = flush;
  if (worker_) return worker_->put(chunk_, flush);
  if (!empty) {
    if (auto done = body_->chunk(chunk_); !done) return done;
    chunk_.clear();
  }
  return flush ? body_->flush() : Result{};
}

Result Writer::settle() {
  if (auto done = close_chunk(false); !done) return done;
  return worker_ ? worker_->wait() : body_->status();
}

Result Writer::flush() {
  if (!chunked()) return body_->flush();
  return close_chunk(true);
}

Result Writer::sync() {
  if (auto done = settle(); !done) return done;
  return body_->sync();
}

Result Writer::attach(const Attachment& attachment) {
  if (auto done = settle(); !done) return done;
  ++statistics_.attachment_count;
  if (auto done = body_->attachment(attachment); !done) return done;
  return body_->flush();
}

Result Writer::add_metadata(const Metadata& metadata) {
  if (auto done = settle(); !done) return done;
  ++statistics_.metadata_count;
  if (auto done = body_->metadata(metadata); !done) return done;
  return body_->flush();
}

Result Writer::finish() {
  if (auto done = settle(); !done) return done;
  return body_->finish(schemas_, channels_, statistics_);
}

}  // namespace mimesis::log
