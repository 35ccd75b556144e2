#include "tools/mimesis/log/check.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/unknown_field_set.h>

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "tools/mimesis/log/human.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

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
  MessageCheck(const log::Source& source, Sequences& sequences, Findings& findings)
      : source_(source), sequences_(sequences), findings_(findings), reader_(source) {}

  /// One record on; false at the end. Then `conclude`.
  bool next() {
    const log::Record* record = reader_.next();
    if (record == nullptr) return false;
    is_log_ = true;
    if (const auto* message = std::get_if<log::Message>(record)) {
      take_message(*message);
    } else if (const auto* schema = std::get_if<log::Schema>(record)) {
      if (!in_summary_) take_schema(*schema);
    } else if (const auto* channel = std::get_if<log::Channel>(record)) {
      if (!in_summary_) take_channel(*channel);
    } else if (const auto* metadata = std::get_if<log::Metadata>(record)) {
      ++statistics_.metadata_count;
      if (metadata->name == kCountsName) {
        has_losses_ = true;
        add_losses(metadata->metadata, losses_);
      }
      recovered_ |= metadata->name == kRecoveredName;
      if (metadata->name == "mimesis.split") split_ = metadata->metadata;
    } else if (std::holds_alternative<log::Attachment>(*record)) {
      ++statistics_.attachment_count;
    } else if (std::holds_alternative<log::DataEnd>(*record)) {
      in_summary_ = true;
    } else if (const auto* statistics = std::get_if<log::Statistics>(record)) {
      check_statistics(*statistics);
    }
    return true;
  }

  std::uint64_t offset() const { return reader_.offset(); }
  void conclude() {
    for (const log::Damage& d : reader_.damages()) {
      const bool cut = d.offset >= source_.size();
      findings_.add(cut ? Severity::warning : Severity::error, cut ? "not-closed" : kDamage,
                    d.offset, d.what);
    }
    if (reader_.damage_count() > reader_.damages().size()) {
      findings_.error(kDamage, std::nullopt, "and {} more damages",
                      reader_.damage_count() - reader_.damages().size());
    }
    for (const auto& [id, state] : states_) report(state);
    if (disorder_.times > 0) {
      findings_.info("order", disorder_.first_offset,
                     "{} messages are earlier than others before them, first {}: readers "
                     "by the index sort them",
                     disorder_.times, disorder_.first);
    }
    if (has_losses_) check_losses();
  }

  std::uint64_t messages() const { return statistics_.message_count; }
  const log::Statistics& statistics() const { return statistics_; }  ///< of what was read
  /// Of metadata "mimesis.split": key -> value, empty if it has none.
  const std::map<std::string, std::string>& split() const { return split_; }
  bool is_log() const { return is_log_; }

 private:
  struct Tally {  ///< of one kind of finding on one channel
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
    statistics_.count(message.channel_id, message.log_time);
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
    if (!decoded.ParseFromArray(message.data.data(), static_cast<int>(message.data.size()))) {
      state.invalid.add(reader_.offset(), 1, fmt::format("no {}", decoded.GetTypeName()));
    } else if (!state.unknown_fields) {
      state.unknown_fields = has_unknown_fields(decoded);
    }
  }

  void take_schema(const log::Schema& schema) {
    const std::uint64_t at = reader_.offset();
    prototypes_.erase(schema.id);
    if (schema.id == 0) findings_.error("schema", at, "a schema has the id 0");
    const auto [known, fresh] = definitions_.try_emplace(schema.name, schema.data);
    if (!fresh && known->second != schema.data) {
      findings_.info("schema", at, "{} is defined in several ways", schema.name);
    }
    if (schema.encoding != "protobuf") {
      if (!schema.encoding.empty() && schema.encoding != "jsonschema") {
        findings_.info("encoding", at, "schema {}: '{}' is not looked into", schema.name,
                       schema.encoding);
      }
      return;
    }
    auto prototype = types_.make(schema.name, schema.data);
    if (prototype == nullptr) {
      findings_.error("schema", at, "schema {}: its descriptor set does not define this type",
                      schema.name);
    }
    prototypes_[schema.id] = std::move(prototype);
  }

  void take_channel(const log::Channel& channel) {
    const std::uint64_t at = reader_.offset();
    if (channel.schema_id != 0 && !reader_.schemas().contains(channel.schema_id)) {
      findings_.error("channel", at, "channel {} ({}): schema {} was not defined before",
                      channel.id, channel.topic, channel.schema_id);
    }
    if (channel.message_encoding != "protobuf" && channel.message_encoding != "json") {
      findings_.info("encoding", at, "channel {} ({}): '{}' is not looked into", channel.id,
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
      findings_.add(severity, kind, tally.first_offset,
                    fmt::format("{}: {}, first {}", s.name, what, tally.first));
    };
    // What the numbers of foreign logs mean is not known.
    const Severity numbers = s.ours ? Severity::warning : Severity::info;
    tell(s.gap, numbers, "seq-gap",
         fmt::format("{} messages are missing in {} gaps", s.gap.sum, s.gap.times));
    tell(s.repeat, numbers, "seq-repeated", fmt::format("{} numbers are repeated", s.repeat.times));
    tell(s.back, numbers, "seq-back", fmt::format("numbers go back {} times", s.back.times));
    tell(s.disorder, Severity::warning, "order",
         fmt::format("{} messages are earlier than those before them", s.disorder.times));
    tell(s.invalid, Severity::error, "content",
         fmt::format("{} messages cannot be decoded", s.invalid.times));
    if (s.unknown_fields) {
      findings_.info("unknown-fields", std::nullopt, "{}",
                     s.name + ": fields that its schema does not know");
    }
    if (s.messages == 0) {
      findings_.info("no-messages", std::nullopt, "{}", s.name + ": no messages");
    }
  }

  void check_statistics(const log::Statistics& stored) {
    const std::uint64_t at = reader_.offset();
    const auto compare = [&](std::string_view what, std::uint64_t read, std::uint64_t says) {
      if (read == says) return;
      findings_.error("statistics", at, "{}: {} in the file, the summary says {}", what, read,
                      says);
    };
    compare("schemas", reader_.schemas().size(), stored.schema_count);
    compare("channels", reader_.channels().size(), stored.channel_count);
    compare("attachments", statistics_.attachment_count, stored.attachment_count);
    compare("metadata records", statistics_.metadata_count, stored.metadata_count);
    compare("first log time", statistics_.message_start_time, stored.message_start_time);
    compare("last log time", statistics_.message_end_time, stored.message_end_time);
    std::map<std::uint16_t, std::uint64_t> counts = stored.channel_message_counts;
    for (const auto& [id, count] : statistics_.channel_message_counts) counts.try_emplace(id, 0);
    for (const auto& [id, says] : counts) {
      const auto read = statistics_.channel_message_counts.find(id);
      compare(fmt::format("messages of {}", state_of(id).name),
              read == statistics_.channel_message_counts.end() ? 0 : read->second, says);
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
        findings_.warning("lost", std::nullopt, "{}: the recorder missed {} messages", key,
                          count.lost);
      }
      // The value that a latched topic had before the file began stands at its head, uncounted.
      if (h.messages == count.received || (h.latched && h.messages == count.received + 1)) continue;
      const bool unexplained = h.messages < count.received && !recovered_;
      findings_.add(unexplained ? Severity::error : Severity::warning, "counts", std::nullopt,
                    fmt::format("{}: {} messages, {} were received by its counts", key, h.messages,
                                count.received));
    }
  }

  const log::Source& source_;
  Sequences& sequences_;
  Findings& findings_;
  log::StreamReader reader_;
  runtime::TypePool types_;  // before the messages that it makes
  std::map<std::uint16_t, std::unique_ptr<google::protobuf::Message>> prototypes_;  ///< by schema
  std::map<std::uint16_t, ChannelState> states_;
  std::map<std::string, std::string> definitions_;  ///< of schemas, by name
  log::Statistics statistics_;
  std::uint64_t last_time_ = 0;
  Tally disorder_;
  LossCounts losses_;
  bool recovered_ = false;  ///< from a damaged log: what is missing is known
  bool has_losses_ = false, in_summary_ = false, is_log_ = false;
  std::map<std::string, std::string> split_;
};

using nlohmann::ordered_json;

struct BySeverity {
  std::array<std::uint64_t, 3> counts{};
  std::uint64_t& operator[](Severity s) { return counts[static_cast<std::size_t>(s)]; }
};

BySeverity count_findings(const std::vector<CheckedLog>& logs) {
  BySeverity n;
  for (const CheckedLog& log : logs) {
    for (const Finding& f : log.findings.list()) ++n[f.severity];
  }
  return n;
}

ordered_json findings_json(const std::vector<CheckedLog>& logs) {
  ordered_json files = ordered_json::array();
  for (const CheckedLog& log : logs) {
    ordered_json findings = ordered_json::array();
    for (const Finding& f : log.findings.list()) {
      findings.push_back({{"severity", word(f.severity)},
                          {"kind", f.kind},
                          {"offset", f.offset ? ordered_json(*f.offset) : ordered_json(nullptr)},
                          {"what", f.what}});
    }
    files.push_back({{"file", log.path},
                     {"size", log.size},
                     {"messages", log.messages},
                     {"findings", std::move(findings)}});
  }
  BySeverity n = count_findings(logs);
  return {{"files", std::move(files)},
          {"errors", n[Severity::error]},
          {"warnings", n[Severity::warning]},
          {"infos", n[Severity::info]}};
}

void print_findings(const std::vector<CheckedLog>& logs) {
  for (const CheckedLog& log : logs) {
    for (const Finding& f : log.findings.list()) {
      std::cout << fmt::format("{}: {}: {}{}\n", word(f.severity), log.path,
                               f.offset ? fmt::format("byte {}: ", *f.offset) : "", f.what);
    }
  }
}

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
  if (json) {
    print_json(findings_json(logs));
  } else {
    print_findings(logs);
  }
  std::uint64_t messages = 0;
  for (const CheckedLog& log : logs) messages += log.messages;
  BySeverity n = count_findings(logs);
  std::cerr << fmt::format("{} messages in {}: {} errors, {} warnings, {} remarks\n", messages,
                           logs.size() == 1 ? logs[0].path : fmt::format("{} files", logs.size()),
                           n[Severity::error], n[Severity::warning], n[Severity::info]);
  return n[Severity::error] == 0 ? 0 : 1;
}

}  // namespace

CheckedLog check_log(const std::string& path, const log::Source& source, Sequences& sequences) {
  const google::protobuf::LogSilencer silence;  // what is wrong with a schema is told here
  CheckedLog checked;
  checked.path = path;
  checked.size = source.size();
  Progress progress("check", 2 * source.size());
  MessageCheck messages(source, sequences, checked.findings);
  while (messages.next()) progress.at(messages.offset());
  messages.conclude();
  if (messages.is_log()) {
    check_structure(source, checked.findings,
                    [&](std::uint64_t done) { progress.at(source.size() + done); });
  }
  checked.findings.sort();
  checked.messages = messages.messages();
  checked.start_ns = messages.statistics().message_start_time;
  checked.end_ns = messages.statistics().message_end_time;
  checked.split = messages.split();
  return checked;
}

void check_parts(std::vector<CheckedLog>& logs) {
  const auto name = [](const std::string& path) {
    return std::filesystem::path(path).filename().string();
  };
  for (std::size_t i = 1; i < logs.size(); ++i) {
    CheckedLog& log = logs[i];
    const CheckedLog& before = logs[i - 1];
    if (log.messages > 0 && before.messages > 0 && log.start_ns < before.end_ns) {
      log.findings.warning("parts", std::nullopt, "begins at {}, before {} ends at {}",
                           human_time(log.start_ns), before.path, human_time(before.end_ns));
    }
    const auto previous = log.split.find("previous");
    if (previous != log.split.end() && previous->second != name(before.path)) {
      log.findings.warning("parts", std::nullopt, "follows '{}' by its metadata, not '{}'",
                           previous->second, name(before.path));
    }
  }
}

std::string_view word(Severity severity) {
  return severity == Severity::info ? "info" : severity == Severity::warning ? "warning" : "error";
}

void add_check(CLI::App& verb, int& exit_code) {
  CLI::App* check = verb.add_subcommand(
      "check", "Looks for everything that can be wrong with logs (like mcap doctor)");
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
