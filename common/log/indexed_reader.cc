#include "common/log/indexed_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "common/log/crc32.h"
#include "common/log/wire.h"

namespace mimesis::log {

/// A chunk in memory with its selected messages in order.
struct IndexedReader::Loaded {
  struct Entry {
    std::uint64_t log_time;
    std::size_t offset, size;  ///< of the content of the record
  };
  std::string packed;
  Decompressor decompressor;
  std::string_view records;
  std::uint64_t file_offset = 0;
  std::vector<Entry> entries;
  std::size_t next = 0;

  std::pair<std::uint64_t, std::uint64_t> key() const {
    return {entries[next].log_time, file_offset};
  }
};

IndexedReader::~IndexedReader() = default;

IndexedReader::IndexedReader(const Source& source, const Summary& summary, Selection selection)
    : source_(source),
      summary_(summary),
      selection_(std::move(selection)),
      channels_(1 << 16, false) {
  for (const auto& [id, channel] : summary_.channels) {
    channels_[id] = !selection_.channel || selection_.channel(channel);
  }
  for (const Segment& segment : summary_.segments) {
    if (wanted(segment)) pending_.push_back(&segment);
  }
  std::ranges::sort(pending_, std::greater{}, [](const Segment* s) {
    return std::tuple(s->index.message_start_time, s->index.chunk_start_offset);
  });
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

void IndexedReader::load(const Segment& segment) {
  const ChunkIndex& index = segment.index;
  const auto damaged = [&](std::string_view why) {
    damages_.push_back({index.chunk_start_offset,
                        fmt::format("chunk of log times {} to {} is skipped: {}",
                                    index.message_start_time, index.message_end_time, why)});
  };
  std::unique_ptr<Loaded> chunk = spare_ ? std::move(spare_) : std::make_unique<Loaded>();
  chunk->file_offset = index.chunk_start_offset;
  chunk->entries.clear();
  chunk->next = 0;
  const std::uint64_t size = source_.size();
  if (index.chunk_start_offset > size || index.chunk_length > size - index.chunk_start_offset) {
    return damaged("it lies behind the end of the file");
  }
  chunk->packed.resize(static_cast<std::size_t>(index.chunk_length));
  const auto n = source_.read(index.chunk_start_offset, chunk->packed.data(), chunk->packed.size());
  if (!n || *n != chunk->packed.size())
    return damaged(n ? "the file became shorter" : n.error().reason);
  chunk->records = chunk->packed;
  if (!segment.bare) {
    Chunk head;
    if (chunk->packed.size() < kRecordHead ||
        static_cast<Opcode>(chunk->packed[0]) != Opcode::chunk ||
        !decode(std::string_view(chunk->packed).substr(kRecordHead), head)) {
      return damaged("there is no chunk at its place");
    }
    const auto compression = parse_compression(head.compression);
    if (!compression) return damaged(fmt::format("unknown compression '{}'", head.compression));
    if (head.uncompressed_size > ReaderLimits{}.chunk_size) return damaged("it is too large");
    const auto records = chunk->decompressor.run(*compression, head.records,
                                                 static_cast<std::size_t>(head.uncompressed_size));
    if (!records) return damaged(records.error().reason);
    if (head.uncompressed_crc != 0 && crc32(0, *records) != head.uncompressed_crc) {
      return damaged("its CRC-32 does not fit");
    }
    chunk->records = *records;
  }
  Decoder d(chunk->records);
  while (d.left() > 0) {
    const auto opcode = d.integer<Opcode>();
    const std::string_view content = d.raw(d.integer<std::uint64_t>());
    Message message;
    if (!d.ok()) {
      damaged("a record does not fit into it");
      break;
    }
    if (opcode != Opcode::message || !decode(content, message) || !channels_[message.channel_id])
      continue;
    if (message.log_time < selection_.start_time || message.log_time >= selection_.end_time)
      continue;
    const auto offset = static_cast<std::size_t>(content.data() - chunk->records.data());
    chunk->entries.push_back({message.log_time, offset, content.size()});
  }
  std::ranges::stable_sort(chunk->entries, {}, &Loaded::Entry::log_time);
  if (!chunk->entries.empty()) {
    loaded_.push_back(std::move(chunk));
  } else {
    spare_ = std::move(chunk);
  }
}

const Message* IndexedReader::next() {
  const auto first = [this] { return std::ranges::min_element(loaded_, {}, &Loaded::key); };
  if (const auto done =
          std::ranges::find_if(loaded_, [](const auto& c) { return c->next == c->entries.size(); });
      done != loaded_.end()) {
    spare_ = std::move(*done);  // the message delivered last was in it
    loaded_.erase(done);
  }
  // A chunk that starts no later than the earliest loaded message may hold an earlier one, or an
  // equal one that stands before it in the file.
  while (!pending_.empty() && (loaded_.empty() || pending_.back()->index.message_start_time <=
                                                      (*first())->key().first)) {
    const Segment* segment = pending_.back();
    pending_.pop_back();
    load(*segment);
  }
  if (loaded_.empty()) return nullptr;
  Loaded& chunk = **first();
  const Loaded::Entry& entry = chunk.entries[chunk.next++];
  const bool ok = decode(chunk.records.substr(entry.offset, entry.size), message_);
  MIMESIS_ASSERT(ok);
  return &message_;
}

}  // namespace mimesis::log
