#include "tools/mimesis/log/check.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/unknown_field_set.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>

#include "common/log/codec.h"
#include "common/log/stream_reader.h"
#include "common/log/wire.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/human.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using log::Opcode;
using enum Severity;

constexpr std::string_view kDamage = "damage";  // a kind: the cause of others

/// Fields that the schema does not know: written by a later version of it.
bool has_unknown_fields(const Message& message) {
  const auto& reflection = *message.GetReflection();
  if (!reflection.GetUnknownFields(message).empty()) return true;
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* f : fields) {
    if (f->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!f->is_repeated()) {
      if (has_unknown_fields(reflection.GetMessage(message, f))) return true;
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, f); ++i) {
      if (has_unknown_fields(reflection.GetRepeatedMessage(message, f, i))) return true;
    }
  }
  return false;
}

/// Looks at all messages of a log in the order of the file: sums, times, sequence numbers,
/// contents.
class MessageCheck {
 public:
  MessageCheck(const log::Source& source, Sequences& sequences, CheckedLog& checked)
      : source_(source), sequences_(sequences), checked_(checked), reader_(source) {}

  /// False if the file is no log.
  bool run(Progress& progress) {
    bool any = false;
    for (const log::Record* record; (record = reader_.next()) != nullptr; any = true) {
      take(*record);
      progress.at(reader_.offset());
    }
    conclude(any);
    return any;
  }

 private:
  void take(const log::Record& record) {
    log::Statistics& count = checked_.statistics;
    if (const auto* message = std::get_if<log::Message>(&record)) {
      take_message(*message);
    } else if (const auto* schema = std::get_if<log::Schema>(&record)) {
      if (!in_summary_) take_schema(*schema);
    } else if (const auto* channel = std::get_if<log::Channel>(&record)) {
      if (!in_summary_) take_channel(*channel);
    } else if (const auto* metadata = std::get_if<log::Metadata>(&record)) {
      ++count.metadata_count;
      if (metadata->name == kCountsName) add_losses(metadata->metadata, losses_);
      recovered_ |= metadata->name == kRecoveredName;
      if (metadata->name == "mimesis.split") checked_.split = metadata->metadata;
    } else if (std::holds_alternative<log::Attachment>(record)) {
      ++count.attachment_count;
    } else if (std::holds_alternative<log::DataEnd>(record)) {
      in_summary_ = true;
    } else if (const auto* statistics = std::get_if<log::Statistics>(&record)) {
      check_statistics(*statistics);
    }
  }

  void conclude(bool any) {
    for (const log::Damage& d : reader_.damages()) {
      const bool cut = any && d.offset >= source_.size();
      checked_.add(cut ? warning : error, cut ? "not-closed" : kDamage, d.offset, "{}", d.what);
    }
    if (const auto more = reader_.damage_count() - reader_.damages().size(); more > 0) {
      checked_.add(error, kDamage, std::nullopt, "and {} more damages", more);
    }
    for (const auto& [id, state] : states_) report(state);
    if (disorder_.times > 0) {
      checked_.add(info, "order", disorder_.first_offset,
                   "{} messages are earlier than others before them, first {}: readers "
                   "by the index sort them",
                   disorder_.times, disorder_.first);
    }
    check_losses();
  }

  struct Tally {  ///< one kind of finding on one channel
    std::uint64_t times = 0, sum = 0;
    std::uint64_t first_offset = 0;
    std::string first;
    void add(std::uint64_t offset, std::uint64_t amount, const std::string& text) {
      if (times++ == 0) {
        first_offset = offset;
        first = text;
      }
      sum += amount;
    }
  };
  struct ChannelState {
    std::string name;  ///< "topic (node)"
    const log::Channel* channel = nullptr;
    Sequence* sequence = nullptr;
    bool ours = false, latched = false;
    bool unknown_fields = false;
    std::uint64_t messages = 0, repeats = 0;
    std::uint64_t last_time = 0;
    Tally gap, repeat, back, disorder, invalid;
  };
  void take_message(const log::Message& message) {
    ChannelState& state = state_of(message.channel_id);
    const std::uint64_t at = reader_.offset();
    const auto earlier = [&](std::uint64_t than) {
      return fmt::format("log time {} ns after {} ns", message.log_time, than);
    };
    if (state.messages > 0 && message.log_time < state.last_time) {
      state.disorder.add(at, 1, earlier(state.last_time));
    }
    if (message.log_time < last_time_) disorder_.add(at, 1, earlier(last_time_));
    state.last_time = message.log_time;
    last_time_ = std::max(last_time_, message.log_time);
    checked_.statistics.count(message.channel_id, message.log_time);
    ++state.messages;
    if (message.sequence != 0 && state.sequence != nullptr) check_sequence(message, state);
    if (state.channel != nullptr) check_content(message, state);
  }

  void check_sequence(const log::Message& message, ChannelState& state) {
    const auto last = state.sequence->last();
    const Sequence::Step step = state.sequence->next(message.sequence);
    const std::string text = fmt::format("seq {} after {}", message.sequence, last.value_or(0));
    if (step.missing > 0) state.gap.add(reader_.offset(), step.missing, text);
    if (step.back) state.back.add(reader_.offset(), 1, text);
    if (!step.repeated) return;
    // The head of a part repeats the last values of latched topics.
    if (state.latched) {
      ++state.repeats;
    } else {
      state.repeat.add(reader_.offset(), 1, text);
    }
  }

  void check_content(const log::Message& message, ChannelState& state) {
    const log::Channel& channel = *state.channel;
    if (channel.message_encoding == "json") {
      if (!nlohmann::json::accept(message.data)) state.invalid.add(reader_.offset(), 1, "no JSON");
      return;
    }
    const auto prototype = prototypes_.find(channel.schema_id);
    if (channel.message_encoding != "protobuf" || prototype == prototypes_.end() ||
        prototype->second == nullptr) {
      return;
    }
    Message& decoded = *prototype->second;
    if (!parse(message.data, decoded)) {
      state.invalid.add(reader_.offset(), 1, fmt::format("no {}", decoded.GetTypeName()));
    } else if (!state.unknown_fields) {
      state.unknown_fields = has_unknown_fields(decoded);
    }
  }

  void take_schema(const log::Schema& schema) {
    const std::uint64_t at = reader_.offset();
    prototypes_.erase(schema.id);
    if (schema.id == 0) checked_.add(error, "schema", at, "a schema has the id 0");
    const auto [known, fresh] = definitions_.try_emplace(schema.name, schema.data);
    if (!fresh && known->second != schema.data) {
      checked_.add(info, "schema", at, "{} is defined in several ways", schema.name);
    }
    if (schema.encoding != "protobuf") {
      if (!schema.encoding.empty() && schema.encoding != "jsonschema") {
        checked_.add(info, "encoding", at, "schema {}: '{}' is not looked into", schema.name,
                     schema.encoding);
      }
      return;
    }
    auto prototype = types_.make(schema.name, schema.data);
    if (prototype == nullptr) {
      checked_.add(error, "schema", at, "schema {}: its descriptor set does not define this type",
                   schema.name);
    }
    prototypes_[schema.id] = std::move(prototype);
  }

  void take_channel(const log::Channel& channel) {
    const std::uint64_t at = reader_.offset();
    if (channel.schema_id != 0 && !reader_.schemas().contains(channel.schema_id)) {
      checked_.add(error, "channel", at, "channel {} ({}): schema {} was not defined before",
                   channel.id, channel.topic, channel.schema_id);
    }
    if (channel.message_encoding != "protobuf" && channel.message_encoding != "json") {
      checked_.add(info, "encoding", at, "channel {} ({}): '{}' is not looked into", channel.id,
                   channel.topic, channel.message_encoding);
    }
    state_of(channel.id);
  }

  ChannelState& state_of(std::uint16_t id) {
    const auto [it, fresh] = states_.try_emplace(id);
    ChannelState& state = it->second;
    if (!fresh && state.channel != nullptr) return state;
    const auto channel = reader_.channels().find(id);
    if (channel == reader_.channels().end()) {
      state.name = fmt::format("channel {}", id);
      return state;
    }
    const std::string node = sender_of(channel->second);
    state.channel = &channel->second;
    state.ours = !node.empty();
    state.latched = is_latched(channel->second);
    state.name = state.ours ? loss_key(channel->second) : channel->second.topic;
    state.sequence = &sequences_[{channel->second.topic, node, start_of(channel->second)}];
    return state;
  }

  void report(const ChannelState& s) {
    const auto tell = [&](const Tally& tally, Severity severity, std::string_view kind,
                          const std::string& what) {
      if (tally.times == 0) return;
      checked_.add(severity, kind, tally.first_offset, "{}: {}, first {}", s.name, what,
                   tally.first);
    };
    // The meaning of numbers in foreign logs is unknown.
    const Severity numbers = s.ours ? warning : info;
    tell(s.gap, numbers, "seq-gap",
         fmt::format("{} messages are missing in {} gaps", s.gap.sum, s.gap.times));
    tell(s.repeat, numbers, "seq-repeated", fmt::format("{} numbers are repeated", s.repeat.times));
    tell(s.back, numbers, "seq-back", fmt::format("numbers go back {} times", s.back.times));
    tell(s.disorder, warning, "order",
         fmt::format("{} messages are earlier than those before them", s.disorder.times));
    tell(s.invalid, error, "content",
         fmt::format("{} messages cannot be decoded", s.invalid.times));
    if (s.unknown_fields) {
      checked_.add(info, "unknown-fields", std::nullopt, "{}: fields that its schema does not know",
                   s.name);
    }
    if (s.messages == 0) {
      checked_.add(info, "no-messages", std::nullopt, "{}: no messages", s.name);
    }
  }

  void check_statistics(const log::Statistics& stored) {
    const std::uint64_t at = reader_.offset();
    const auto compare = [&](std::string_view what, std::uint64_t read, std::uint64_t says) {
      if (read == says) return;
      checked_.add(error, "statistics", at, "{}: {} in the file, the summary says {}", what, read,
                   says);
    };
    log::Statistics read = checked_.statistics;
    compare("schemas", reader_.schemas().size(), stored.schema_count);
    compare("channels", reader_.channels().size(), stored.channel_count);
    compare("attachments", read.attachment_count, stored.attachment_count);
    compare("metadata records", read.metadata_count, stored.metadata_count);
    compare("first log time", read.message_start_time, stored.message_start_time);
    compare("last log time", read.message_end_time, stored.message_end_time);
    std::map<std::uint16_t, std::uint64_t> counts = stored.channel_message_counts;
    for (const auto& [id, count] : read.channel_message_counts) counts.try_emplace(id, 0);
    for (const auto& [id, says] : counts) {
      compare(fmt::format("messages of {}", state_of(id).name), read.channel_message_counts[id],
              says);
    }
  }

  void check_losses() {
    struct Held {
      std::uint64_t messages = 0;
      bool latched = false;
    };
    std::map<std::string, Held> held;
    for (const auto& [id, s] : states_) {
      if (s.channel == nullptr) continue;
      Held& h = held[loss_key(*s.channel)];
      h.messages += s.messages - s.repeats;
      h.latched |= s.latched;
    }
    for (const auto& [key, count] : losses_) {
      const Held& h = held[key];
      if (count.lost > 0) {
        checked_.add(warning, "lost", std::nullopt, "{}: the recorder missed {} messages", key,
                     count.lost);
      }
      // The value that a latched topic had before the file began stands at its head, uncounted.
      if (h.messages == count.received || (h.latched && h.messages == count.received + 1)) continue;
      const bool unexplained = h.messages < count.received && !recovered_;
      checked_.add(unexplained ? error : warning, "counts", std::nullopt,
                   "{}: {} messages, {} were received by its counts", key, h.messages,
                   count.received);
    }
  }

  const log::Source& source_;
  Sequences& sequences_;
  CheckedLog& checked_;
  log::StreamReader reader_;
  runtime::TypePool types_;  // before the messages that it makes
  std::map<std::uint16_t, std::unique_ptr<google::protobuf::Message>> prototypes_;  ///< by schema
  std::map<std::uint16_t, ChannelState> states_;
  std::map<std::string, std::string> definitions_;  ///< definitions of schemas, by name
  std::uint64_t last_time_ = 0;
  Tally disorder_;
  LossCounts losses_;
  bool recovered_ = false;  ///< from a damaged log: missing parts are known
  bool in_summary_ = false;
};

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

using nlohmann::ordered_json;

/// Exit code 0: no errors; 1: errors; 3: a file is not there.
int check_files(const std::vector<std::string>& paths, bool json) {
  std::vector<CheckedLog> logs;
  Sequences sequences;
  for (const std::string& path : paths) {
    const auto source = log::open_file(path);
    if (!source) throw VerbEnd{source.error().reason, std::filesystem::exists(path) ? 1 : 3};
    logs.push_back(check_log(path, **source, sequences));
  }
  check_parts(logs);
  std::array<std::uint64_t, 3> found{};  // by severity
  std::uint64_t messages = 0;
  ordered_json files = ordered_json::array();
  for (const CheckedLog& log : logs) {
    messages += log.statistics.message_count;
    ordered_json findings = ordered_json::array();
    for (const Finding& f : log.findings) {
      ++found[static_cast<std::size_t>(f.severity)];
      findings.push_back({{"severity", word(f.severity)},
                          {"kind", f.kind},
                          {"offset", json_or_null(f.offset)},
                          {"what", f.what}});
      if (json) continue;
      std::cout << fmt::format("{}: {}: {}{}\n", word(f.severity), log.path,
                               f.offset ? fmt::format("byte {}: ", *f.offset) : "",
                               printable(f.what));
    }
    files.push_back({{"file", log.path},
                     {"size", log.size},
                     {"messages", log.statistics.message_count},
                     {"findings", std::move(findings)}});
  }
  const auto [infos, warnings, errors] = found;
  if (json) {
    print_json({{"files", std::move(files)},
                {"errors", errors},
                {"warnings", warnings},
                {"infos", infos}});
  }
  std::cerr << fmt::format("{} messages in {}: {} errors, {} warnings, {} remarks\n", messages,
                           logs.size() == 1 ? logs[0].path : fmt::format("{} files", logs.size()),
                           errors, warnings, infos);
  return errors == 0 ? 0 : 1;
}

}  // namespace

CheckedLog check_log(const std::string& path, const log::Source& source, Sequences& sequences) {
  const google::protobuf::LogSilencer silence;  // errors of a schema are reported here
  CheckedLog checked{path, source.size()};
  Progress progress("check", 2 * source.size());
  if (MessageCheck(source, sequences, checked).run(progress)) {
    StructureCheck(source, checked).walk(progress);
  }
  std::ranges::stable_sort(checked.findings, {}, [](const Finding& f) {
    return std::pair(-static_cast<int>(f.severity), f.kind != kDamage);
  });
  return checked;
}

void check_parts(std::vector<CheckedLog>& logs) {
  const auto name = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  for (std::size_t i = 1; i < logs.size(); ++i) {
    CheckedLog& log = logs[i];
    const CheckedLog& before = logs[i - 1];
    if (log.statistics.message_count > 0 && before.statistics.message_count > 0 &&
        log.statistics.message_start_time < before.statistics.message_end_time) {
      log.add(warning, "parts", std::nullopt, "begins at {}, before {} ends at {}",
              human_time(log.statistics.message_start_time), before.path,
              human_time(before.statistics.message_end_time));
    }
    const auto previous = log.split.find("previous");
    if (previous != log.split.end() && previous->second != name(before.path)) {
      log.add(warning, "parts", std::nullopt, "follows '{}' by its metadata, not '{}'",
              previous->second, name(before.path));
    }
  }
}

std::string_view word(Severity severity) {
  return severity == info ? "info" : severity == warning ? "warning" : "error";
}

void add_check(CLI::App& verb, int& exit_code) {
  CLI::App* check =
      verb.add_subcommand("check", "Checks logs for all kinds of errors (like mcap doctor)");
  struct Options {
    std::vector<std::string> files;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  check->add_option("FILE", options->files, "MCAP files: several are parts, in this order")
      ->required();
  check->add_flag("--json", options->json, "One JSON object");
  check->footer(
      "All sums, records, indexes; order of log times; gaps and repetitions of sequence numbers;\n"
      "schemas and the contents of all messages; summary and counts against the data. One line "
      "per\n"
      "finding: error, warning or info. Exit code 1 if there is an error.\n"
      "Example: mimesis log check run.mcap --json | jq '.files[].findings[]'");
  on_run(*check, exit_code, [options] { return check_files(options->files, options->json); });
}

}  // namespace mimesis::tool
