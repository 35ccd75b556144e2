#pragma once
#include <atomic>
#include <string>
#include <vector>

#include "common/log/chunk_buffer.h"
#include "common/log/codec.h"
#include "common/log/spill.h"
#include "common/log/writer.h"

namespace mimesis::log {

/// The file as it grows: compresses, sums, writes and remembers where things stand. Used by one
/// thread at a time; `position` by any. A failure is final: all later calls return it.
class FileBody {
 public:
  FileBody(Sink& sink, const WriterOptions& options);

  Result record(std::string_view bytes);
  Result chunk(ChunkBuffer& closed);
  Result attachment(const Attachment& attachment);
  Result metadata(const Metadata& metadata);
  Result flush();
  Result sync();
  /// Ends the data, writes the summary and closes the sink.
  Result finish(const std::vector<Schema>& schemas, const std::vector<Channel>& channels,
                const Statistics& statistics);

  std::uint64_t position() const { return position_.load(std::memory_order_relaxed); }
  const Result& status() const { return status_; }

 private:
  Result emit(std::string_view bytes);
  Result emit(std::string_view bytes, std::uint32_t crc_of_bytes);
  Result write_summary(const std::vector<Schema>& schemas, const std::vector<Channel>& channels,
                       const Statistics& statistics);

  Sink& sink_;
  const WriterOptions& options_;
  Compressor compressor_;
  Result status_;
  std::atomic<std::uint64_t> position_ = 0;
  std::uint32_t crc_ = 0;  ///< sum of all bytes so far; of the summary's bytes once it has begun
  std::string record_;     ///< scratch

  Spill chunk_indexes_;  ///< records: all that grows with the file
  std::vector<AttachmentIndex> attachment_indexes_;
  std::vector<MetadataIndex> metadata_indexes_;
};

}  // namespace mimesis::log
