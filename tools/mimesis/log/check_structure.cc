#include "tools/mimesis/log/check_structure.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "common/log/codec.h"
#include "common/log/records.h"
#include "common/log/stream_reader.h"
#include "common/log/wire.h"

namespace mimesis::tool {
namespace {

using log::Opcode;

/// (log_time, offset) of messages in a chunk, by channel.
using Places = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;

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

class Structure {
 public:
  Structure(const log::Source& source, Findings& findings)
      : source_(source), findings_(findings), window_(source) {}

  void walk(const std::function<void(std::uint64_t)>& progress);

 private:
  struct Record {
    std::uint64_t offset = 0, length = 0;
  };
  /// What is known of a chunk from the data.
  struct Facts {
    log::ChunkIndex index;  ///< as it should be
    Places messages;
    bool readable = false;
  };
  void error(std::string_view kind, std::uint64_t offset, std::string what) {
    findings_.add(Severity::error, kind, offset, std::move(what));
  }
  bool take(Opcode opcode, std::string_view content);
  void take_chunk(std::string_view content);
  void take_message_index(std::string_view content);
  void leave_chunk();
  void take_chunk_index(std::string_view content);
  template <class Index>
  void take_record_index(std::string_view content, std::map<std::uint64_t, std::uint64_t>& records,
                         std::string_view what);
  void take_summary(Opcode opcode, std::string_view content);
  void take_footer(std::string_view content);
  void conclude();

  const log::Source& source_;
  Findings& findings_;
  log::Window window_;
  log::Decompressor decompressor_;
  std::uint64_t at_ = log::kMagic.size();  ///< of the current record
  std::uint64_t length_ = 0;

  std::map<std::uint64_t, Facts> chunks_;  ///< by offset
  Facts* open_ = nullptr;                  ///< the chunk whose message indexes follow
  std::map<std::uint64_t, std::uint64_t> attachments_, metadata_;  ///< offset -> length
  std::optional<std::uint64_t> data_end_;                          ///< behind it
  std::map<std::uint64_t, bool> indexed_chunks_;
  std::optional<std::uint64_t> bare_message_;
  bool index_records_ = false, attachment_indexes_ = false, metadata_indexes_ = false;
  std::map<Opcode, Record> groups_;  ///< of the summary
  std::vector<std::pair<std::uint64_t, log::SummaryOffset>> offsets_;
};

void Structure::walk(const std::function<void(std::uint64_t)>& progress) {
  const std::uint64_t size = source_.size();
  while (true) {
    const auto head = window_.view(at_, log::kRecordHead);
    if (!head || head->size() < log::kRecordHead) break;
    log::Decoder d(*head);
    const auto opcode = d.integer<Opcode>();
    const auto length = d.integer<std::uint64_t>();
    if (opcode == Opcode{0} || length > size - at_ - log::kRecordHead ||
        length > log::ReaderLimits{}.record_size) {
      findings_.add(Severity::info, "index", at_, "the index is not checked from here on");
      return;
    }
    length_ = log::kRecordHead + length;
    const auto record = window_.view(at_, static_cast<std::size_t>(length_));
    if (!record || record->size() < length_) return;
    if (!take(opcode, record->substr(log::kRecordHead))) return conclude();
    progress(at_ += length_);
  }
  leave_chunk();
}

/// False behind the footer.
bool Structure::take(Opcode opcode, std::string_view content) {
  if (opcode != Opcode::message_index) leave_chunk();
  if (at_ == log::kMagic.size() && opcode != Opcode::header) {
    error("structure", at_, "the first record is not a header");
  }
  if (opcode == Opcode::footer) {
    take_footer(content);
    return false;
  }
  if (data_end_) {
    take_summary(opcode, content);
    return true;
  }
  switch (opcode) {
    case Opcode::chunk:
      take_chunk(content);
      break;
    case Opcode::message_index:
      take_message_index(content);
      break;
    case Opcode::attachment:
      attachments_[at_] = length_;
      break;
    case Opcode::metadata:
      metadata_[at_] = length_;
      break;
    case Opcode::message:
      if (!bare_message_) bare_message_ = at_;
      break;
    case Opcode::data_end:
      data_end_ = at_ + length_;
      break;
    default:
      break;
  }
  return true;
}

void Structure::take_chunk(std::string_view content) {
  open_ = &chunks_[at_];
  log::Chunk chunk;
  if (!log::decode(content, chunk)) return;
  log::ChunkIndex& index = open_->index;
  index.message_start_time = chunk.message_start_time;
  index.message_end_time = chunk.message_end_time;
  index.chunk_start_offset = at_;
  index.chunk_length = length_;
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
    error("chunk-times", at_,
          fmt::format("chunk: its messages are of {} to {}, its head says {} to {}", times->first,
                      times->second, chunk.message_start_time, chunk.message_end_time));
  }
}

void Structure::take_message_index(std::string_view content) {
  if (open_ == nullptr) {
    error("message-index", at_, "a message index without a chunk before it");
    return;
  }
  log::MessageIndex index;
  if (!decode_index(content, index)) {
    error("message-index", at_, "a message index is too short for its entries");
    return;
  }
  open_->index.message_index_offsets[index.channel_id] = at_;
  open_->index.message_index_length += length_;
  if (!open_->readable) return;
  auto stands = open_->messages[index.channel_id];
  std::ranges::sort(stands);
  std::ranges::sort(index.records);
  if (stands == index.records) return;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> wrong;
  std::ranges::set_difference(index.records, stands, std::back_inserter(wrong));
  error(
      "message-index", at_,
      wrong.empty()
          ? fmt::format("message index of channel {}: {} entries for {} messages", index.channel_id,
                        index.records.size(), stands.size())
          : fmt::format("message index of channel {}: {} entries point at no such message, "
                        "first ({} ns, {})",
                        index.channel_id, wrong.size(), wrong.front().first, wrong.front().second));
}

void Structure::leave_chunk() {
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

void Structure::take_summary(Opcode opcode, std::string_view content) {
  Record& group = groups_.try_emplace(opcode, Record{at_, 0}).first->second;
  group.length = at_ + length_ - group.offset;
  if (opcode == Opcode::chunk_index) {
    take_chunk_index(content);
  } else if (opcode == Opcode::attachment_index) {
    attachment_indexes_ = true;
    take_record_index<log::AttachmentIndex>(content, attachments_, "attachment");
  } else if (opcode == Opcode::metadata_index) {
    metadata_indexes_ = true;
    take_record_index<log::MetadataIndex>(content, metadata_, "metadata");
  } else if (opcode == Opcode::summary_offset) {
    log::SummaryOffset offset;
    if (log::decode(content, offset)) offsets_.emplace_back(at_, offset);
  } else if (log::Statistics statistics; opcode == Opcode::statistics &&
                                         log::decode(content, statistics) &&
                                         statistics.chunk_count != chunks_.size()) {
    error("statistics", at_,
          fmt::format("chunks: {} in the file, the summary says {}", chunks_.size(),
                      statistics.chunk_count));
  }
}

void Structure::take_chunk_index(std::string_view content) {
  index_records_ = true;
  log::ChunkIndex index;
  if (!log::decode(content, index)) return;  // told as damage
  const auto it = chunks_.find(index.chunk_start_offset);
  if (it == chunks_.end()) {
    error("chunk-index", at_,
          fmt::format("chunk index: no chunk stands at byte {}", index.chunk_start_offset));
    return;
  }
  indexed_chunks_[index.chunk_start_offset] = true;
  const log::ChunkIndex& is = it->second.index;
  const auto compare = [&](std::string_view what, const auto& says, const auto& stands) {
    if (says == stands) return;
    error("chunk-index", at_,
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
    error("chunk-index", at_,
          fmt::format("index of the chunk at byte {}: its message indexes stand elsewhere",
                      index.chunk_start_offset));
  }
}

template <class Index>
void Structure::take_record_index(std::string_view content,
                                  std::map<std::uint64_t, std::uint64_t>& records,
                                  std::string_view what) {
  Index index;
  if (!log::decode(content, index)) return;  // told as damage
  const auto it = records.find(index.offset);
  if (it == records.end() || it->second != index.length) {
    error("index", at_,
          fmt::format("{} '{}': no such record stands at byte {}", what, index.name, index.offset));
  } else {
    records.erase(it);
  }
}

void Structure::take_footer(std::string_view content) {
  log::Footer footer;
  if (!log::decode(content, footer) || !data_end_) return;
  const bool has_summary = at_ > *data_end_;
  if (footer.summary_start != 0 && footer.summary_start != *data_end_) {
    error("structure", at_,
          fmt::format("the summary starts at byte {}, the footer says {}", *data_end_,
                      footer.summary_start));
  }
  if (footer.summary_start == 0 && has_summary) {
    findings_.add(Severity::warning, "structure", at_, "the footer does not name the summary");
  }
  const auto group = groups_.find(Opcode::summary_offset);
  if (footer.summary_offset_start != 0 &&
      (group == groups_.end() || group->second.offset != footer.summary_offset_start)) {
    error("structure", at_,
          fmt::format("no summary offsets stand at byte {}, where the footer says",
                      footer.summary_offset_start));
  }
}

void Structure::conclude() {
  for (const auto& [at, offset] : offsets_) {
    const auto group = groups_.find(offset.group_opcode);
    if (group == groups_.end() || group->second.offset != offset.group_start ||
        group->second.length != offset.group_length) {
      error("structure", at,
            fmt::format("no group of {} records stands at byte {}", log::name(offset.group_opcode),
                        offset.group_start));
    }
  }
  if (index_records_) {
    for (const auto& [offset, facts] : chunks_) {
      if (!indexed_chunks_.contains(offset)) {
        error("chunk-index", offset, "this chunk is in no index: readers that seek miss it");
      }
    }
    if (bare_message_) {
      error("chunk-index", *bare_message_,
            "a message outside of chunks: readers that seek miss it");
    }
  }
  for (const auto& [offset, length] : attachments_) {
    if (attachment_indexes_) error("index", offset, "this attachment is in no index");
  }
  for (const auto& [offset, length] : metadata_) {
    if (metadata_indexes_) error("index", offset, "this metadata record is in no index");
  }
}

}  // namespace

void check_structure(const log::Source& source, Findings& findings,
                     const std::function<void(std::uint64_t)>& progress) {
  Structure(source, findings).walk(progress);
}

}  // namespace mimesis::tool
