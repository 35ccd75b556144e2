#pragma once
#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/log/codec.h"
#include "common/log/io.h"
#include "common/log/records.h"

namespace mimesis::log {

class ChunkWorker;
class FileBody;

/// The records of a chunk that is being filled, and the contents of its indexes. Memory is kept
/// when it is cleared.
struct ChunkBuffer {
  std::string records;
  std::uint64_t start_time = 0, end_time = 0;  ///< of its messages; 0 without
  bool has_messages = false;
  std::vector<MessageIndex> messages;  ///< by channel id; most may be empty

  void add(const Message& message, bool indexed) {
    start_time = has_messages ? std::min(start_time, message.log_time) : message.log_time;
    end_time = std::max(end_time, message.log_time);
    has_messages = true;
    if (indexed) {
      if (message.channel_id >= messages.size()) messages.resize(message.channel_id + 1u);
      messages[message.channel_id].records.emplace_back(message.log_time, records.size());
    }
    append(records, message);
  }
  void clear() {
    records.clear();
    start_time = end_time = 0;
    has_messages = false;
    for (MessageIndex& index : messages) index.records.clear();
  }
};

struct WriterOptions {
  std::string profile = {};         ///< "" unless the file follows a published profile
  std::string library = "mimesis";  ///< name of the writing program
  Compression compression = Compression::zstd;
  int zstd_level = kZstdLevel;  ///< 1 (fast) to 19 (small)
  /// A chunk is closed when its records reach this size [bytes]; 0: no chunks.
  std::size_t chunk_size = 1024 * 1024;
  /// Chunks are compressed, summed and written by a thread of the writer; false: by the caller's,
  /// for small files. The bytes are the same.
  bool background = true;
  // Parts of the index that readers use to seek. All are written unless a test compares single
  // ones.
  bool message_index = true, chunk_index = true, statistics = true;
  bool repeat_schemas = true, repeat_channels = true;
  bool attachment_index = true, metadata_index = true, summary_offsets = true;
};

/// Writes one MCAP file: data in chunks, then a summary that lets readers seek. Every sum the
/// format knows is written: per chunk, per attachment, over the data section and over the summary.
/// Memory is bounded by four chunks and 16 bytes per message in them, plus one index entry per
/// chunk. Used by one thread; the sink is called from the worker's.
///
/// A failure to write is final: it is returned by the first call after it was met and by all later
/// ones; `sync` and `finish` wait for it.
class Writer {
 public:
  /// Writes magic and header; a failure is returned by the next call. `sink` outlives the writer.
  Writer(Sink& sink, WriterOptions options);
  /// Without `finish`: closed chunks are written, the open one is lost.
  ~Writer();

  /// Ids count from 1.
  [[nodiscard]] tl::expected<std::uint16_t, Status> add_schema(std::string name,
                                                               std::string encoding,
                                                               std::string data);
  /// `schema_id`: of add_schema, or 0 for none.
  [[nodiscard]] tl::expected<std::uint16_t, Status> add_channel(
      std::uint16_t schema_id, std::string topic, std::string message_encoding,
      std::map<std::string, std::string> metadata);
  /// Precondition: the channel was added.
  [[nodiscard]] Result write(const Message& message);
  /// Closes the open chunk. As soon as it is compressed it is handed to the operating system and
  /// survives a kill. Does not wait for that, but for room among the pending chunks.
  [[nodiscard]] Result flush();
  /// Flushes and waits until all is on the disk: written data survives a power cut.
  [[nodiscard]] Result sync();

  /// Attachments and metadata stand between chunks; the open one is closed first and written. The
  /// sum is computed.
  [[nodiscard]] Result attach(const Attachment& attachment);
  [[nodiscard]] Result add_metadata(const Metadata& metadata);

  /// Writes the summary and closes the sink. Last call.
  [[nodiscard]] Result finish();

  const Statistics& statistics() const { return statistics_; }
  std::uint64_t bytes_written() const;  ///< so far, without pending chunks
  std::size_t open_chunk_bytes() const { return chunk_.records.size(); }  ///< not yet closed

 private:
  bool chunked() const { return options_.chunk_size > 0; }
  Result status();
  void count(const Message& message);
  template <class T>
  Result add(const T& record);
  Result close_chunk(bool flush);
  Result settle();  ///< closes the chunk and waits: the body is ours

  WriterOptions options_;
  std::unique_ptr<FileBody> body_;
  std::unique_ptr<ChunkWorker> worker_;  ///< null: chunks are written by the caller's thread
  ChunkBuffer chunk_;                    ///< the open one
  std::string record_;                   ///< scratch for one record outside of chunks
  bool flushed_ = true;                  ///< nothing was closed since

  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  Statistics statistics_;
  std::vector<std::uint64_t*> channel_counts_;  ///< into statistics_, by channel id; null: none yet
};

}  // namespace mimesis::log
