#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/log/io.h"
#include "common/log/records.h"
#include "common/log/stream_reader.h"

namespace mimesis::log {

/// A run of messages in the file that is read at once: a chunk, or messages that stand outside of
/// chunks.
struct Segment {
  ChunkIndex index;
  bool bare = false;  ///< not a chunk: the records themselves, `chunk_length` bytes
  /// Unpacked size that is usable from a chunk whose end is missing at the end of the file; else 0
  /// [bytes].
  std::size_t salvaged = 0;
};

/// Contents of a file, and their positions.
struct Summary {
  Header header;
  std::map<std::uint16_t, Schema> schemas;
  std::map<std::uint16_t, Channel> channels;
  Statistics statistics;
  bool counted = true;            ///< false: the file's summary has no statistics; `scan` counts
  std::vector<Segment> segments;  ///< in file order
  std::vector<AttachmentIndex> attachments;
  std::vector<MetadataIndex> metadata;
  bool from_file = false;       ///< the file's own summary; false: the whole file was read
  std::uint64_t start = 0;      ///< of the file's own summary: the data ends there
  std::vector<Damage> damages;  ///< found by that reading
  std::uint64_t damage_count = 0;
};

/// Reads the summary at the end of the file; if there is no usable one (a killed recorder, a
/// damaged end, no index), reads the whole file and makes one. Fails only if the file is no log at
/// all.
tl::expected<Summary, Status> summarize(const Source& source, const ReaderLimits& limits = {});

/// Makes the summary from the data alone: checks every sum.
tl::expected<Summary, Status> scan(const Source& source, const ReaderLimits& limits = {});

/// Reads the data of a log whose own summary was taken, unpacks nothing, and compares its sum: the
/// damage, if there is one.
std::optional<Damage> check_data_sum(const Source& source, const Summary& summary);

/// The record at an index entry; the data of the attachment is put into `data`, its CRC is checked.
tl::expected<Attachment, Status> read_attachment(const Source& source, const AttachmentIndex& index,
                                                 std::string& data);
tl::expected<Metadata, Status> read_metadata(const Source& source, const MetadataIndex& index);

}  // namespace mimesis::log
