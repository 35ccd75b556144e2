#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/log/codec.h"
#include "common/log/records.h"
#include "common/log/stream_reader.h"
#include "common/log/wire.h"
#include "tools/mimesis/log/check.h"

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

/// Holds the chunks of a log against their heads, the message indexes behind them and the chunk
/// indexes of the summary. Takes the records in the order of the file; `at` is where one stands,
/// `length` its bytes with the head.
class ChunkCheck {
 public:
  explicit ChunkCheck(Findings& findings) : findings_(findings) {}

  void take_chunk(std::uint64_t at, std::uint64_t length, std::string_view content) {
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
      findings_.error("chunk-times", at,
                      "chunk: its messages are of {} to {}, its head says {} to {}", times->first,
                      times->second, chunk.message_start_time, chunk.message_end_time);
    }
  }

  void take_message_index(std::uint64_t at, std::uint64_t length, std::string_view content) {
    if (open_ == nullptr) {
      findings_.error("message-index", at, "a message index without a chunk before it");
      return;
    }
    log::MessageIndex index;
    if (!decode_index(content, index)) {
      findings_.error("message-index", at, "a message index is too short for its entries");
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
    findings_.error(
        "message-index", at, "{}",
        wrong.empty()
            ? fmt::format("message index of channel {}: {} entries for {} messages",
                          index.channel_id, index.records.size(), stands.size())
            : fmt::format("message index of channel {}: {} entries point at no such message, "
                          "first ({} ns, {})",
                          index.channel_id, wrong.size(), wrong.front().first,
                          wrong.front().second));
  }

  /// What comes now belongs no longer to the last chunk.
  void leave() {
    if (open_ == nullptr) return;
    const Facts& facts = *open_;
    const auto& offsets = facts.index.message_index_offsets;
    if (!offsets.empty()) {
      for (const auto& [id, places] : facts.messages) {
        if (places.empty() || offsets.contains(id)) continue;
        findings_.error("message-index", facts.index.chunk_start_offset,
                        "chunk: its messages of channel {} are in no index", id);
      }
    }
    open_->messages.clear();
    open_ = nullptr;
  }

  void take_bare_message(std::uint64_t at) {
    if (!bare_message_) bare_message_ = at;
  }
  void take_chunk_index(std::uint64_t at, std::string_view content) {
    any_index_ = true;
    log::ChunkIndex index;
    if (!log::decode(content, index)) return;  // told as damage
    const auto it = chunks_.find(index.chunk_start_offset);
    if (it == chunks_.end()) {
      findings_.error("chunk-index", at, "chunk index: no chunk stands at byte {}",
                      index.chunk_start_offset);
      return;
    }
    indexed_.insert(index.chunk_start_offset);
    const log::ChunkIndex& is = it->second.index;
    const auto compare = [&](std::string_view what, const auto& says, const auto& stands) {
      if (says == stands) return;
      findings_.error("chunk-index", at, "index of the chunk at byte {}: {} is {}, not {}",
                      index.chunk_start_offset, what, stands, says);
    };
    compare("its first log time", index.message_start_time, is.message_start_time);
    compare("its last log time", index.message_end_time, is.message_end_time);
    compare("its length", index.chunk_length, is.chunk_length);
    compare("its compression", index.compression, is.compression);
    compare("its compressed size", index.compressed_size, is.compressed_size);
    compare("its unpacked size", index.uncompressed_size, is.uncompressed_size);
    compare("the length of its message indexes", index.message_index_length,
            is.message_index_length);
    if (index.message_index_offsets != is.message_index_offsets) {
      findings_.error("chunk-index", at,
                      "index of the chunk at byte {}: its message indexes stand elsewhere",
                      index.chunk_start_offset);
    }
  }

  std::size_t count() const { return chunks_.size(); }
  /// behind the footer
  void conclude() {
    if (!any_index_) return;
    for (const auto& [offset, facts] : chunks_) {
      if (!indexed_.contains(offset)) {
        findings_.error("chunk-index", offset,
                        "this chunk is in no index: readers that seek miss it");
      }
    }
    if (bare_message_) {
      findings_.error("chunk-index", *bare_message_,
                      "a message outside of chunks: readers that seek miss it");
    }
  }

 private:
  /// (log_time, offset) of messages in a chunk, by channel.
  using Places = std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::uint64_t>>>;
  /// What is known of a chunk from the data.
  struct Facts {
    log::ChunkIndex index;  ///< as it should be
    Places messages;
    bool readable = false;
  };

  Findings& findings_;
  log::Decompressor decompressor_;
  std::map<std::uint64_t, Facts> chunks_;  ///< by offset
  Facts* open_ = nullptr;                  ///< the chunk whose message indexes follow
  std::set<std::uint64_t> indexed_;
  std::optional<std::uint64_t> bare_message_;
  bool any_index_ = false;
};

class StructureCheck {
 public:
  StructureCheck(const log::Source& source, Findings& findings)
      : source_(source), findings_(findings), window_(source), chunks_(findings) {}

  void walk(const std::function<void(std::uint64_t)>& progress) {
    const std::uint64_t size = source_.size();
    while (true) {
      const auto head = window_.view(at_, log::kRecordHead);
      if (!head || head->size() < log::kRecordHead) break;
      log::Decoder d(*head);
      const auto opcode = d.integer<Opcode>();
      const auto length = d.integer<std::uint64_t>();
      if (opcode == Opcode{0} || length > size - at_ - log::kRecordHead ||
          length > log::ReaderLimits{}.record_size) {
        findings_.info("index", at_, "the index is not checked from here on");
        return;
      }
      length_ = log::kRecordHead + length;
      const auto record = window_.view(at_, static_cast<std::size_t>(length_));
      if (!record || record->size() < length_) return;
      if (!take(opcode, record->substr(log::kRecordHead))) return conclude();
      progress(at_ += length_);
    }
    chunks_.leave();
  }

 private:
  struct Record {
    std::uint64_t offset = 0, length = 0;
  };
  /// False behind the footer.
  bool take(Opcode opcode, std::string_view content) {
    if (opcode != Opcode::message_index) chunks_.leave();
    if (at_ == log::kMagic.size() && opcode != Opcode::header) {
      findings_.error("structure", at_, "the first record is not a header");
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
        chunks_.take_chunk(at_, length_, content);
        break;
      case Opcode::message_index:
        chunks_.take_message_index(at_, length_, content);
        break;
      case Opcode::attachment:
        attachments_[at_] = length_;
        break;
      case Opcode::metadata:
        metadata_[at_] = length_;
        break;
      case Opcode::message:
        chunks_.take_bare_message(at_);
        break;
      case Opcode::data_end:
        data_end_ = at_ + length_;
        break;
      default:
        break;
    }
    return true;
  }

  template <class Index>
  void take_record_index(std::string_view content, std::map<std::uint64_t, std::uint64_t>& records,
                         std::string_view what) {
    Index index;
    if (!log::decode(content, index)) return;  // told as damage
    const auto it = records.find(index.offset);
    if (it == records.end() || it->second != index.length) {
      findings_.error("index", at_, "{} '{}': no such record stands at byte {}", what, index.name,
                      index.offset);
    } else {
      records.erase(it);
    }
  }

  void take_summary(Opcode opcode, std::string_view content) {
    Record& group = groups_.try_emplace(opcode, Record{at_, 0}).first->second;
    group.length = at_ + length_ - group.offset;
    if (opcode == Opcode::chunk_index) {
      chunks_.take_chunk_index(at_, content);
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
                                           statistics.chunk_count != chunks_.count()) {
      findings_.error("statistics", at_, "chunks: {} in the file, the summary says {}",
                      chunks_.count(), statistics.chunk_count);
    }
  }

  void take_footer(std::string_view content) {
    log::Footer footer;
    if (!log::decode(content, footer) || !data_end_) return;
    const bool has_summary = at_ > *data_end_;
    if (footer.summary_start != 0 && footer.summary_start != *data_end_) {
      findings_.error("structure", at_, "the summary starts at byte {}, the footer says {}",
                      *data_end_, footer.summary_start);
    }
    if (footer.summary_start == 0 && has_summary) {
      findings_.warning("structure", at_, "the footer does not name the summary");
    }
    const auto group = groups_.find(Opcode::summary_offset);
    if (footer.summary_offset_start != 0 &&
        (group == groups_.end() || group->second.offset != footer.summary_offset_start)) {
      findings_.error("structure", at_,
                      "no summary offsets stand at byte {}, where the footer says",
                      footer.summary_offset_start);
    }
  }

  void conclude() {
    for (const auto& [at, offset] : offsets_) {
      const auto group = groups_.find(offset.group_opcode);
      if (group == groups_.end() || group->second.offset != offset.group_start ||
          group->second.length != offset.group_length) {
        findings_.error("structure", at, "no group of {} records stands at byte {}",
                        log::name(offset.group_opcode), offset.group_start);
      }
    }
    chunks_.conclude();
    for (const auto& [offset, length] : attachments_) {
      if (attachment_indexes_) findings_.error("index", offset, "this attachment is in no index");
    }
    for (const auto& [offset, length] : metadata_) {
      if (metadata_indexes_)
        findings_.error("index", offset, "this metadata record is in no index");
    }
  }

  const log::Source& source_;
  Findings& findings_;
  log::Window window_;
  ChunkCheck chunks_;
  std::uint64_t at_ = log::kMagic.size();  ///< of the current record
  std::uint64_t length_ = 0;

  std::map<std::uint64_t, std::uint64_t> attachments_, metadata_;  ///< offset -> length
  std::optional<std::uint64_t> data_end_;                          ///< behind it
  bool attachment_indexes_ = false, metadata_indexes_ = false;
  std::map<Opcode, Record> groups_;  ///< of the summary
  std::vector<std::pair<std::uint64_t, log::SummaryOffset>> offsets_;
};

}  // namespace

void check_structure(const log::Source& source, Findings& findings,
                     const std::function<void(std::uint64_t)>& progress) {
  StructureCheck(source, findings).walk(progress);
}

}  // namespace mimesis::tool
