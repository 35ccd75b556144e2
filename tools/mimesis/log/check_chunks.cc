#include "tools/mimesis/log/check_chunks.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/log/stream_reader.h"
#include "common/log/wire.h"

namespace mimesis::tool {
namespace {

using log::Opcode;

bool decode_index(std::string_view content, log::MessageIndex& index) {
  log::Decoder d(content);
  index.channel_id = d.integer<std::uint16_t>();
  log::Decoder entries(d.string());
  index.records.clear();
  while (entries.left() > 0 && entries.ok()) {
    const auto time = entries.integer<std::uint64_t>();
    const auto offset = entries.integer<std::uint64_t>();
    index.records.emplace_back(time, offset);
  }
  return d.ok() && entries.ok();
}

}  // namespace

void ChunkCheck::take_chunk(std::uint64_t at, std::uint64_t length, std::string_view content) {
  open_ = &chunks_[at];
  log::Chunk chunk;
  if (!log::decode(content, chunk)) return;
  log::ChunkIndex& index = open_->index;
  index.message_start_time = chunk.message_start_time;
  index.message_end_time = chunk.message_end_time;
  index.chunk_start_offset = at;
  index.chunk_length = length;
  index.compression = chunk.compression;
  index.compressed_size = chunk.records.size();
  index.uncompressed_size = chunk.uncompressed_size;
  const auto compression = log::parse_compression(chunk.compression);
  if (!compression || chunk.uncompressed_size > log::ReaderLimits{}.chunk_size) return;
  const auto records = decompressor_.run(*compression, chunk.records,
                                         static_cast<std::size_t>(chunk.uncompressed_size));
  if (!records) return;  // told by whoever checks the sums
  open_->readable = true;
  std::optional<std::pair<std::uint64_t, std::uint64_t>> times;
  log::Decoder d(*records);
  while (d.left() > 0) {
    const std::uint64_t offset = records->size() - d.left();
    const auto opcode = d.integer<Opcode>();
    const std::string_view inner = d.raw(d.integer<std::uint64_t>());
    log::Message message;
    if (!d.ok()) break;
    if (opcode != Opcode::message || !log::decode(inner, message)) continue;
    open_->messages[message.channel_id].emplace_back(message.log_time, offset);
    if (!times) times = {message.log_time, message.log_time};
    times->first = std::min(times->first, message.log_time);
    times->second = std::max(times->second, message.log_time);
  }
  if (times &&
      (times->first != chunk.message_start_time || times->second != chunk.message_end_time)) {
    error("chunk-times", at,
          fmt::format("chunk: its messages are of {} to {}, its head says {} to {}", times->first,
                      times->second, chunk.message_start_time, chunk.message_end_time));
  }
}

void ChunkCheck::take_message_index(std::uint64_t at, std::uint64_t length,
                                    std::string_view content) {
  if (open_ == nullptr) {
    error("message-index", at, "a message index without a chunk before it");
    return;
  }
  log::MessageIndex index;
  if (!decode_index(content, index)) {
    error("message-index", at, "a message index is too short for its entries");
    return;
  }
  open_->index.message_index_offsets[index.channel_id] = at;
  open_->index.message_index_length += length;
  if (!open_->readable) return;
  auto stands = open_->messages[index.channel_id];
  std::ranges::sort(stands);
  std::ranges::sort(index.records);
  if (stands == index.records) return;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> wrong;
  std::ranges::set_difference(index.records, stands, std::back_inserter(wrong));
  error(
      "message-index", at,
      wrong.empty()
          ? fmt::format("message index of channel {}: {} entries for {} messages", index.channel_id,
                        index.records.size(), stands.size())
          : fmt::format("message index of channel {}: {} entries point at no such message, "
                        "first ({} ns, {})",
                        index.channel_id, wrong.size(), wrong.front().first, wrong.front().second));
}

void ChunkCheck::leave() {
  if (open_ == nullptr) return;
  const Facts& facts = *open_;
  const auto& offsets = facts.index.message_index_offsets;
  if (!offsets.empty()) {
    for (const auto& [id, places] : facts.messages) {
      if (places.empty() || offsets.contains(id)) continue;
      error("message-index", facts.index.chunk_start_offset,
            fmt::format("chunk: its messages of channel {} are in no index", id));
    }
  }
  open_->messages.clear();
  open_ = nullptr;
}

void ChunkCheck::take_chunk_index(std::uint64_t at, std::string_view content) {
  any_index_ = true;
  log::ChunkIndex index;
  if (!log::decode(content, index)) return;  // told as damage
  const auto it = chunks_.find(index.chunk_start_offset);
  if (it == chunks_.end()) {
    error("chunk-index", at,
          fmt::format("chunk index: no chunk stands at byte {}", index.chunk_start_offset));
    return;
  }
  indexed_.insert(index.chunk_start_offset);
  const log::ChunkIndex& is = it->second.index;
  const auto compare = [&](std::string_view what, const auto& says, const auto& stands) {
    if (says == stands) return;
    error("chunk-index", at,
          fmt::format("index of the chunk at byte {}: {} is {}, not {}", index.chunk_start_offset,
                      what, stands, says));
  };
  compare("its first log time", index.message_start_time, is.message_start_time);
  compare("its last log time", index.message_end_time, is.message_end_time);
  compare("its length", index.chunk_length, is.chunk_length);
  compare("its compression", index.compression, is.compression);
  compare("its compressed size", index.compressed_size, is.compressed_size);
  compare("its unpacked size", index.uncompressed_size, is.uncompressed_size);
  compare("the length of its message indexes", index.message_index_length, is.message_index_length);
  if (index.message_index_offsets != is.message_index_offsets) {
    error("chunk-index", at,
          fmt::format("index of the chunk at byte {}: its message indexes stand elsewhere",
                      index.chunk_start_offset));
  }
}

void ChunkCheck::conclude() {
  if (!any_index_) return;
  for (const auto& [offset, facts] : chunks_) {
    if (!indexed_.contains(offset)) {
      error("chunk-index", offset, "this chunk is in no index: readers that seek miss it");
    }
  }
  if (bare_message_) {
    error("chunk-index", *bare_message_, "a message outside of chunks: readers that seek miss it");
  }
}

}  // namespace mimesis::tool
