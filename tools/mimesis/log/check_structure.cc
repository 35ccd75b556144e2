#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "common/log/codec.h"
#include "common/log/wire.h"
#include "tools/mimesis/log/check.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {
namespace {

using log::Opcode;
using enum Severity;

/// Follows the records of a log by their lengths and compares every index with its target: message
/// indexes, chunk index, attachment and metadata indexes, offsets of the summary. Sums were checked
/// before; after an impossible record it stops and reports it.
class StructureCheck {
 public:
  StructureCheck(const log::Source& source, CheckedLog& checked)
      : source_(source), checked_(checked), window_(source) {}

  void walk(Progress& progress) {
    const std::uint64_t size = source_.size();
    while (true) {
      const auto head = window_.view(at_, log::kRecordHead);
      if (!head || head->size() < log::kRecordHead) break;
      log::Decoder d(*head);
      const auto opcode = d.integer<Opcode>();
      const auto length = d.integer<std::uint64_t>();
      if (opcode == Opcode{0} || length > size - at_ - log::kRecordHead ||
          length > log::ReaderLimits{}.record_size) {
        return checked_.add(info, "index", at_, "the index is not checked from here on");
      }
      length_ = log::kRecordHead + length;
      const auto record = window_.view(at_, static_cast<std::size_t>(length_));
      if (!record || record->size() < length_) return;
      if (!take(opcode, record->substr(log::kRecordHead))) return conclude();
      progress.at(size + (at_ += length_));
    }
    leave_chunk();
  }

 private:
  using Place = std::pair<std::uint64_t, std::uint64_t>;  ///< place of a message: log time, offset
  /// Facts about a chunk from the data.
  struct Facts {
    log::ChunkIndex index;                                 ///< the index as it should be
    std::map<std::uint16_t, std::vector<Place>> messages;  ///< by channel, while it is open
    bool readable = false;
  };
  /// Attachments or metadata records.
  struct Indexed {
    std::string_view kind, record;
    std::map<std::uint64_t, std::uint64_t> lengths = {};  ///< by offset, of those in no index yet
    bool any_index = false;
  };
  struct Group {
    std::uint64_t offset = 0, length = 0;
  };

  template <class... Args>
  void wrong(std::string_view kind, std::uint64_t offset, fmt::format_string<Args...> what,
             Args&&... args) {
    checked_.add(error, kind, offset, what, std::forward<Args>(args)...);
  }

  /// False behind the footer.
  bool take(Opcode opcode, std::string_view content) {
    if (opcode != Opcode::message_index) leave_chunk();
    if (at_ == log::kMagic.size() && opcode != Opcode::header) {
      wrong("structure", at_, "the first record is not a header");
    }
    if (opcode == Opcode::footer) {
      take_footer(content);
      return false;
    }
    if (data_end_) {
      take_summary(opcode, content);
    } else if (opcode == Opcode::chunk) {
      take_chunk(content);
    } else if (opcode == Opcode::message_index) {
      take_message_index(content);
    } else if (opcode == Opcode::attachment) {
      attachments_.lengths[at_] = length_;
    } else if (opcode == Opcode::metadata) {
      metadata_.lengths[at_] = length_;
    } else if (opcode == Opcode::message && !bare_message_) {
      bare_message_ = at_;
    } else if (opcode == Opcode::data_end) {
      data_end_ = at_ + length_;
    }
    return true;
  }

  void take_chunk(std::string_view content) {
    open_ = &chunks_[at_];
    log::Chunk chunk;
    if (!log::decode(content, chunk)) return;
    open_->index = {.message_start_time = chunk.message_start_time,
                    .message_end_time = chunk.message_end_time,
                    .chunk_start_offset = at_,
                    .chunk_length = length_,
                    .message_index_offsets = {},
                    .message_index_length = 0,
                    .compression = chunk.compression,
                    .compressed_size = chunk.records.size(),
                    .uncompressed_size = chunk.uncompressed_size};
    const auto compression = log::parse_compression(chunk.compression);
    if (!compression || chunk.uncompressed_size > log::ReaderLimits{}.chunk_size) return;
    const auto records = decompressor_.run(*compression, chunk.records,
                                           static_cast<std::size_t>(chunk.uncompressed_size));
    if (!records) return;  // reported by the check of the sums
    open_->readable = true;
    log::Statistics times;
    log::Decoder d(*records);
    while (d.left() > 0) {
      const std::uint64_t offset = records->size() - d.left();
      const auto opcode = d.integer<Opcode>();
      const std::string_view inner = d.raw(d.integer<std::uint64_t>());
      log::Message message;
      if (!d.ok()) break;
      if (opcode != Opcode::message || !log::decode(inner, message)) continue;
      open_->messages[message.channel_id].emplace_back(message.log_time, offset);
      times.count(message.log_time);
    }
    const std::uint64_t first = times.message_start_time, last = times.message_end_time;
    if (times.message_count > 0 &&
        (first != chunk.message_start_time || last != chunk.message_end_time)) {
      wrong("chunk-times", at_, "chunk: its messages are of {} to {}, its head says {} to {}",
            first, last, chunk.message_start_time, chunk.message_end_time);
    }
  }

  void take_message_index(std::string_view content) {
    constexpr std::string_view kKind = "message-index";
    if (open_ == nullptr) return wrong(kKind, at_, "a message index without a chunk before it");
    log::MessageIndex index;
    if (!log::decode(content, index)) {
      return wrong(kKind, at_, "a message index is too short for its entries");
    }
    open_->index.message_index_offsets[index.channel_id] = at_;
    open_->index.message_index_length += length_;
    if (!open_->readable) return;
    auto stands = open_->messages[index.channel_id];
    std::ranges::sort(stands);
    std::ranges::sort(index.records);
    if (stands == index.records) return;
    std::vector<Place> bad;
    std::ranges::set_difference(index.records, stands, std::back_inserter(bad));
    if (bad.empty()) {
      return wrong(kKind, at_, "message index of channel {}: {} entries for {} messages",
                   index.channel_id, index.records.size(), stands.size());
    }
    wrong(kKind, at_,
          "message index of channel {}: {} entries point at no such message, first ({} ns, {})",
          index.channel_id, bad.size(), bad.front().first, bad.front().second);
  }

  /// The next records no longer belong to the last chunk.
  void leave_chunk() {
    if (open_ == nullptr) return;
    const auto& offsets = open_->index.message_index_offsets;
    for (const auto& [id, places] : open_->messages) {
      if (places.empty() || offsets.empty() || offsets.contains(id)) continue;
      wrong("message-index", open_->index.chunk_start_offset,
            "chunk: its messages of channel {} are in no index", id);
    }
    open_->messages.clear();
    open_ = nullptr;
  }

  void take_summary(Opcode opcode, std::string_view content) {
    Group& group = groups_.try_emplace(opcode, Group{at_, 0}).first->second;
    group.length = at_ + length_ - group.offset;
    if (opcode == Opcode::chunk_index) {
      take_chunk_index(content);
    } else if (opcode == Opcode::attachment_index) {
      take_record_index<log::AttachmentIndex>(content, attachments_);
    } else if (opcode == Opcode::metadata_index) {
      take_record_index<log::MetadataIndex>(content, metadata_);
    } else if (opcode == Opcode::summary_offset) {
      log::SummaryOffset offset;
      if (log::decode(content, offset)) offsets_.emplace_back(at_, offset);
    } else if (log::Statistics statistics; opcode == Opcode::statistics &&
                                           log::decode(content, statistics) &&
                                           statistics.chunk_count != chunks_.size()) {
      wrong("statistics", at_, "chunks: {} in the file, the summary says {}", chunks_.size(),
            statistics.chunk_count);
    }
  }

  template <class Index>
  void take_record_index(std::string_view content, Indexed& records) {
    records.any_index = true;
    Index index;
    if (!log::decode(content, index)) return;  // told as damage
    const auto it = records.lengths.find(index.offset);
    if (it != records.lengths.end() && it->second == index.length) {
      records.lengths.erase(it);
    } else {
      wrong("index", at_, "{} '{}': no such record stands at byte {}", records.kind, index.name,
            index.offset);
    }
  }

  void take_chunk_index(std::string_view content) {
    constexpr std::string_view kKind = "chunk-index";
    any_chunk_index_ = true;
    log::ChunkIndex says;
    if (!log::decode(content, says)) return;  // told as damage
    const std::uint64_t offset = says.chunk_start_offset;
    const auto it = chunks_.find(offset);
    if (it == chunks_.end()) {
      return wrong(kKind, at_, "chunk index: no chunk stands at byte {}", offset);
    }
    indexed_chunks_.insert(offset);
    const log::ChunkIndex& is = it->second.index;
    const auto compare = [&](std::string_view what, auto log::ChunkIndex::*field) {
      if (says.*field == is.*field) return;
      wrong(kKind, at_, "index of the chunk at byte {}: {} is {}, not {}", offset, what, is.*field,
            says.*field);
    };
    compare("its first log time", &log::ChunkIndex::message_start_time);
    compare("its last log time", &log::ChunkIndex::message_end_time);
    compare("its length", &log::ChunkIndex::chunk_length);
    compare("its compression", &log::ChunkIndex::compression);
    compare("its compressed size", &log::ChunkIndex::compressed_size);
    compare("its unpacked size", &log::ChunkIndex::uncompressed_size);
    compare("the length of its message indexes", &log::ChunkIndex::message_index_length);
    if (says.message_index_offsets != is.message_index_offsets) {
      wrong(kKind, at_, "index of the chunk at byte {}: its message indexes stand elsewhere",
            offset);
    }
  }

  void take_footer(std::string_view content) {
    log::Footer footer;
    if (!log::decode(content, footer) || !data_end_) return;
    if (footer.summary_start != 0 && footer.summary_start != *data_end_) {
      wrong("structure", at_, "the summary starts at byte {}, the footer says {}", *data_end_,
            footer.summary_start);
    }
    if (footer.summary_start == 0 && at_ > *data_end_) {
      checked_.add(warning, "structure", at_, "the footer does not name the summary");
    }
    const auto group = groups_.find(Opcode::summary_offset);
    if (footer.summary_offset_start != 0 &&
        (group == groups_.end() || group->second.offset != footer.summary_offset_start)) {
      wrong("structure", at_, "no summary offsets stand at byte {}, where the footer says",
            footer.summary_offset_start);
    }
  }

  void conclude() {
    for (const auto& [at, offset] : offsets_) {
      const auto group = groups_.find(offset.group_opcode);
      if (group == groups_.end() || group->second.offset != offset.group_start ||
          group->second.length != offset.group_length) {
        wrong("structure", at, "no group of {} records stands at byte {}",
              log::name(offset.group_opcode), offset.group_start);
      }
    }
    for (const auto& [offset, facts] : chunks_) {
      if (!any_chunk_index_ || indexed_chunks_.contains(offset)) continue;
      wrong("chunk-index", offset, "this chunk is in no index: readers that seek miss it");
    }
    if (any_chunk_index_ && bare_message_) {
      wrong("chunk-index", *bare_message_,
            "a message outside of chunks: readers that seek miss it");
    }
    for (const Indexed* records : {&attachments_, &metadata_}) {
      for (const auto& [offset, length] : records->lengths) {
        if (records->any_index) wrong("index", offset, "this {} is in no index", records->record);
      }
    }
  }

  const log::Source& source_;
  CheckedLog& checked_;
  log::Window window_;
  log::Decompressor decompressor_;
  std::uint64_t at_ = log::kMagic.size();  ///< position of the current record
  std::uint64_t length_ = 0;               ///< with its head

  std::map<std::uint64_t, Facts> chunks_;  ///< by offset
  Facts* open_ = nullptr;                  ///< the chunk whose message indexes follow
  std::set<std::uint64_t> indexed_chunks_;
  std::optional<std::uint64_t> bare_message_;
  bool any_chunk_index_ = false;
  Indexed attachments_{"attachment", "attachment"}, metadata_{"metadata", "metadata record"};
  std::optional<std::uint64_t> data_end_;  ///< behind it
  std::map<Opcode, Group> groups_;         ///< groups of the summary
  std::vector<std::pair<std::uint64_t, log::SummaryOffset>> offsets_;
};

}  // namespace

void check_structure(const log::Source& source, CheckedLog& checked, Progress& progress) {
  StructureCheck(source, checked).walk(progress);
}

}  // namespace mimesis::tool
