#include "common/log/indexed_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <tuple>

#include "common/log/codec.h"
#include "common/log/records.h"
#include "common/log/wire.h"

namespace mimesis::log {

/// A chunk in memory with its selected messages in order.
struct IndexedReader::Loaded {
  struct Entry {
    std::uint64_t log_time;
    std::size_t offset, size;  ///< place of the record's content
  };
  const Segment* segment = nullptr;
  Buffer packed;
  Decompressor decompressor;
  std::string_view records;
  std::vector<Entry> entries;
  std::size_t next = 0;
  std::optional<std::string> damage;

  std::pair<std::uint64_t, std::uint64_t> key() const {
    return {entries[next].log_time, segment->index.chunk_start_offset};
  }

  /// Reads and unpacks the segment; returns why that cannot be.
  std::optional<std::string> load(const Source& source);
  std::optional<std::string> unpack(std::string_view bytes);
  /// Finds the messages wanted; returns why that cannot be.
  std::optional<std::string> index(const std::vector<bool>& channels, const Selection& selection,
                                   const std::map<std::uint16_t, Channel>& known);
};

std::optional<std::string> IndexedReader::Loaded::load(const Source& source) {
  const ChunkIndex& index = segment->index;
  records = {};
  const std::uint64_t size = source.size();
  if (index.chunk_start_offset > size || index.chunk_length > size - index.chunk_start_offset) {
    return "it lies behind the end of the file";
  }
  const auto length = static_cast<std::size_t>(index.chunk_length);
  char* bytes = packed.reserve(length);
  const auto n = source.read(index.chunk_start_offset, bytes, length);
  if (!n || *n != length) return n ? "the file became shorter" : n.error().reason;
  if (!segment->bare) return unpack({bytes, length});
  records = {bytes, length};
  return std::nullopt;
}

std::optional<std::string> IndexedReader::Loaded::unpack(std::string_view bytes) {
  Chunk head;
  std::uint64_t size = 0;
  const std::string_view content = bytes.substr(std::min(kRecordHead, bytes.size()));
  if (bytes.empty() || static_cast<Opcode>(bytes[0]) != Opcode::chunk ||
      !decode_head(content, head, size) || (size > head.records.size() && segment->salvaged == 0)) {
    return "there is no chunk at its place";
  }
  const auto compression = parse_compression(head.compression);
  if (!compression) return fmt::format("unknown compression '{}'", head.compression);
  if (head.uncompressed_size > ReaderLimits{}.chunk_size) return "it is too large";
  head.records = head.records.substr(0, static_cast<std::size_t>(size));
  if (segment->salvaged > 0) {
    head.records = head.records.substr(0, without_zeros(head.records));
    records = decompressor.run_beginning(*compression, head.records, segment->salvaged);
    records = records.substr(0, segment->salvaged);
    return std::nullopt;
  }
  const auto unpacked = decompressor.run(*compression, head.records,
                                         static_cast<std::size_t>(head.uncompressed_size));
  if (!unpacked) return unpacked.error().reason;
  if (head.uncompressed_crc != 0 && crc32(0, *unpacked) != head.uncompressed_crc) {
    return "its CRC-32 does not fit";
  }
  records = *unpacked;
  return std::nullopt;
}

std::optional<std::string> IndexedReader::Loaded::index(
    const std::vector<bool>& channels, const Selection& selection,
    const std::map<std::uint16_t, Channel>& known) {
  Decoder d(records);
  while (d.left() > 0) {
    const auto opcode = d.integer<Opcode>();
    const std::string_view content = d.raw(d.integer<std::uint64_t>());
    if (!d.ok()) return "a record does not fit into it";
    if (Channel channel; opcode == Opcode::channel && decode(content, channel)) {
      const auto summarized = known.find(channel.id);
      if (summarized == known.end() || summarized->second == channel) continue;
      entries.clear();  // they would go by a wrong topic
      return fmt::format("channel {} is '{}' in it, '{}' in the summary", channel.id, channel.topic,
                         summarized->second.topic);
    }
    Message message;
    if (opcode != Opcode::message || !decode(content, message) || !channels[message.channel_id])
      continue;
    if (message.log_time < selection.start_time || message.log_time >= selection.end_time) continue;
    const auto offset = static_cast<std::size_t>(content.data() - records.data());
    entries.push_back({message.log_time, offset, content.size()});
  }
  return std::nullopt;
}

IndexedReader::~IndexedReader() = default;

IndexedReader::IndexedReader(const Source& source, const Summary& summary, Selection selection)
    : source_(source),
      selection_(std::move(selection)),
      channels_(1 << 16, false),
      known_(summary.channels) {
  for (const auto& [id, channel] : summary.channels) {
    channels_[id] = !selection_.channel || selection_.channel(channel);
  }
  for (const Segment& segment : summary.segments) {
    if (wanted(segment)) segments_.push_back(&segment);
  }
  std::ranges::sort(segments_, {}, [](const Segment* s) {
    return std::tuple(s->index.message_start_time, s->index.chunk_start_offset);
  });
  const auto claim = [this](Loaded& chunk) {
    if (claimed_ == segments_.size()) return false;
    chunk.segment = segments_[claimed_++];
    return true;
  };
  const auto work = [this](Loaded& chunk) {
    chunk.entries.clear();
    chunk.next = 0;
    chunk.damage = chunk.load(source_);
    if (chunk.damage) return;
    chunk.damage = chunk.index(channels_, selection_, known_);
    if (std::ranges::is_sorted(chunk.entries, {}, &Loaded::Entry::log_time)) return;
    std::ranges::stable_sort(chunk.entries, {}, &Loaded::Entry::log_time);
  };
  const auto memory = [](const Loaded& chunk) {
    const ChunkIndex& index = chunk.segment->index;
    return static_cast<std::size_t>(index.chunk_length + index.uncompressed_size);
  };
  ahead_ = std::make_unique<ReadAhead<Loaded>>(claim, work, memory, true);
}

bool IndexedReader::wanted(const Segment& segment) const {
  const ChunkIndex& index = segment.index;
  if (index.message_end_time < selection_.start_time ||
      index.message_start_time >= selection_.end_time) {
    return false;
  }
  return index.message_index_offsets.empty() ||
         std::ranges::any_of(index.message_index_offsets,
                             [&](const auto& at) { return channels_[at.first]; });
}

bool IndexedReader::later(const std::unique_ptr<Loaded>& a, const std::unique_ptr<Loaded>& b) {
  return a->key() > b->key();
}

/// The next chunk joins the loaded ones.
void IndexedReader::take() {
  std::unique_ptr<Loaded> chunk = ahead_->take();
  ++taken_;
  const ChunkIndex& index = chunk->segment->index;
  if (chunk->damage) {
    damages_.push_back(
        {index.chunk_start_offset,
         fmt::format("chunk of log times {} to {} is skipped: {}", index.message_start_time,
                     index.message_end_time, *chunk->damage)});
  }
  if (chunk->entries.empty()) return ahead_->give_back(std::move(chunk));
  loaded_.push_back(std::move(chunk));
  std::ranges::push_heap(loaded_, later);
}

const Message* IndexedReader::next() {
  if (delivered_) {  // its message was in use until now
    std::ranges::pop_heap(loaded_, later);
    if (++loaded_.back()->next < loaded_.back()->entries.size()) {
      std::ranges::push_heap(loaded_, later);
    } else {
      ahead_->give_back(std::move(loaded_.back()));
      loaded_.pop_back();
    }
    delivered_ = false;
  }
  // A chunk that starts no later than the earliest loaded message may hold an earlier one, or an
  // equal one that stands before it in the file.
  while (taken_ < segments_.size() &&
         (loaded_.empty() ||
          segments_[taken_]->index.message_start_time <= loaded_.front()->key().first)) {
    take();
  }
  if (loaded_.empty()) return nullptr;
  Loaded& chunk = *loaded_.front();
  const Loaded::Entry& entry = chunk.entries[chunk.next];
  const bool ok = decode(chunk.records.substr(entry.offset, entry.size), message_);
  MIMESIS_ASSERT(ok);
  delivered_ = true;
  return &message_;
}

}  // namespace mimesis::log
