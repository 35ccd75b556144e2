#include "common/log/writer.h"

#include <limits>

#include "common/log/chunk_worker.h"
#include "common/log/file_body.h"

namespace mimesis::log {
namespace {
constexpr std::size_t kMaxIds = std::numeric_limits<std::uint16_t>::max();
}

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
