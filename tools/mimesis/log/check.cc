#include "tools/mimesis/log/check.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/unknown_field_set.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/log/codec.h"
#include "common/log/stream_reader.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/json_depth.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
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

  void run() {
    Progress progress("check", source_.size());
    bool any = false;
    for (const log::Record* record; (record = reader_.next()) != nullptr; any = true) {
      take(*record);
      progress.at(reader_.offset());
    }
    conclude(any);
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
    Tally gap, repeat, back, disorder, invalid, deep;
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
      const std::uint64_t at = reader_.offset();
      if (!nlohmann::json::accept(message.data)) {
        state.invalid.add(at, 1, "no JSON");
      } else if (nested_deeper(message.data, kDeepestShown)) {
        state.deep.add(at, 1, fmt::format("{} bytes", message.data.size()));
      }
      return;
    }
    const auto prototype = prototypes_.find(channel.schema_id);
    const bool is_cdr = channel.message_encoding == "cdr";
    if ((channel.message_encoding != "protobuf" && !is_cdr) || prototype == prototypes_.end() ||
        prototype->second == nullptr) {
      return;
    }
    const LogType& type = *prototype->second;
    if (const std::string why = type.read(message.data); !why.empty()) {
      state.invalid.add(reader_.offset(), 1,
                        is_cdr ? why : fmt::format("no {}", type.message().GetTypeName()));
    } else if (!state.unknown_fields) {
      state.unknown_fields = has_unknown_fields(type.message());
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
    if (!LogType::reads(schema)) {
      if (!schema.encoding.empty() && schema.encoding != "jsonschema") {
        checked_.add(info, "encoding", at, "schema {}: '{}' is not looked into", schema.name,
                     schema.encoding);
      }
      return;
    }
    try {
      prototypes_[schema.id] = std::make_unique<LogType>(schema, types_);
    } catch (const ConfigError& e) {
      checked_.add(error, "schema", at, "schema {}: {}", schema.name, e.what());
    }
  }

  void take_channel(const log::Channel& channel) {
    const std::uint64_t at = reader_.offset();
    if (channel.schema_id != 0 && !reader_.schemas().contains(channel.schema_id)) {
      checked_.add(error, "channel", at, "channel {} ({}): schema {} was not defined before",
                   channel.id, channel.topic, channel.schema_id);
    }
    const std::string& encoding = channel.message_encoding;
    const bool is_ros = encoding == "cdr" && prototypes_.contains(channel.schema_id);
    if (encoding != "protobuf" && encoding != "json" && !is_ros) {
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
    tell(s.deep, warning, "content",
         fmt::format("{} messages are nested deeper than {}, too deep to be shown", s.deep.times,
                     kDeepestShown));
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
  std::map<std::uint16_t, std::unique_ptr<LogType>> prototypes_;  ///< by schema
  std::map<std::uint16_t, ChannelState> states_;
  std::map<std::string, std::string> definitions_;  ///< definitions of schemas, by name
  std::uint64_t last_time_ = 0;
  Tally disorder_;
  LossCounts losses_;
  bool recovered_ = false;  ///< from a damaged log: missing parts are known
  bool in_summary_ = false;
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
  MessageCheck(source, sequences, checked).run();
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
  CLI::App* check = verb.add_subcommand("check", "Checks sums, order and contents of logs");
  struct Options {
    std::vector<std::string> files;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  check->add_option("FILE", options->files, "MCAP files: several are parts, in this order")
      ->required();
  check->add_flag("--json", options->json, "One JSON object");
  check->footer(
      "All sums and records; order of log times; gaps and repetitions of sequence numbers;\n"
      "schemas and the contents of all messages; summary and counts against the data. One line "
      "per\n"
      "finding: error, warning or info. Exit code 1 if there is an error.\n"
      "Example: mimesis log check run.mcap --json | jq '.files[].findings[]'");
  on_run(*check, exit_code, [options] { return check_files(options->files, options->json); });
}

}  // namespace mimesis::tool
