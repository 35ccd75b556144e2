#include "tools/mimesis/log/check_structure.h"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <vector>

#include "common/log/records.h"
#include "common/log/stream_reader.h"
#include "common/log/wire.h"
#include "tools/mimesis/log/check_chunks.h"

namespace mimesis::tool {
namespace {

using log::Opcode;

class Structure {
 public:
  Structure(const log::Source& source, Findings& findings)
      : source_(source), findings_(findings), window_(source), chunks_(findings) {}

  void walk(const std::function<void(std::uint64_t)>& progress);

 private:
  struct Record {
    std::uint64_t offset = 0, length = 0;
  };
  void error(std::string_view kind, std::uint64_t offset, std::string what) {
    findings_.add(Severity::error, kind, offset, std::move(what));
  }
  bool take(Opcode opcode, std::string_view content);
  template <class Index>
  void take_record_index(std::string_view content, std::map<std::uint64_t, std::uint64_t>& records,
                         std::string_view what);
  void take_summary(Opcode opcode, std::string_view content);
  void take_footer(std::string_view content);
  void conclude();

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
  chunks_.leave();
}

/// False behind the footer.
bool Structure::take(Opcode opcode, std::string_view content) {
  if (opcode != Opcode::message_index) chunks_.leave();
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

void Structure::take_summary(Opcode opcode, std::string_view content) {
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
    error("statistics", at_,
          fmt::format("chunks: {} in the file, the summary says {}", chunks_.count(),
                      statistics.chunk_count));
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
  chunks_.conclude();
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
