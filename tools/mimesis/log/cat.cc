// `mimesis log cat`: messages, an attachment or a metadata record on standard output.
#include "tools/mimesis/log/cat.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/logging.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <unordered_map>

#include "common/error.h"
#include "common/json_text.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/json_depth.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

constexpr std::size_t kTextBuffer = 64 * 1024;  // per write [bytes]

/// How the messages of one channel become text.
struct ChannelPrinter {
  std::string head;               ///< up to the sequence number
  const LogType* type = nullptr;  ///< null: foreign
  std::vector<FieldPath> fields;
  bool json = false;     ///< the payload itself is JSON
  bool skipped = false;  ///< has none of the fields
};

class MessagePrinter {
 public:
  MessagePrinter(const std::vector<OpenLog>& logs, const CatOptions& options,
                 const TopicFilter& filter)
      : bytes_(options.bytes == "hex"      ? BytesText::hex
               : options.bytes == "base64" ? BytesText::base64
                                           : BytesText::length),
        fields_(options.fields) {
    for (const OpenChannel& c : channels_of(logs)) {
      if (filter(c.channel->topic)) add(c);
    }
    // A field that no selected topic has is a mistake; with one type it is known which.
    for (const auto& [path, reasons] : misses_) {
      if (found_.contains(path)) continue;
      throw ConfigError(reasons.size() == 1
                            ? *reasons.begin()
                            : fmt::format("no selected topic has a field '{}'", path));
    }
  }

  /// Appends a line; false if the message has nothing to show.
  bool line(const Item& item, std::string& out) {
    ChannelPrinter& printer = printers_.at(item.channel);
    if (printer.skipped) return false;
    JsonText text(out, bytes_);
    const log::Message& m = *item.message;
    text.raw(printer.head);
    text.integer(m.sequence);
    text.raw(",\"log_time_ns\":");
    text.integer(m.log_time);
    text.raw(",\"publish_time_ns\":");
    text.integer(m.publish_time);
    payload(printer, item, text);
    text.raw("}\n");
    return true;
  }
  std::uint64_t invalid() const { return invalid_; }  ///< messages that are not of their type

 private:
  void add(const OpenChannel& c) {
    ChannelPrinter& printer = printers_[c.channel];
    JsonText head(printer.head, bytes_);
    head.raw("{\"topic\":");
    head.string(c.channel->topic);
    head.raw(",\"node\":");
    head.string(sender_of(*c.channel));
    head.raw(",\"seq\":");
    printer.json = c.channel->message_encoding == "json";
    if (c.schema != nullptr && LogType::reads(*c.schema, c.channel->message_encoding)) {
      printer.type = decoder_.type(*c.schema);
    }
    for (const std::string& path : fields_) {
      if (printer.type == nullptr) continue;
      try {
        printer.fields.emplace_back(*printer.type->message().GetDescriptor(), path);
        found_.insert(path);
      } catch (const ConfigError& e) {
        misses_[path].insert(e.what());
      }
    }
    printer.skipped = !fields_.empty() && printer.fields.empty();
  }

  void payload(ChannelPrinter& printer, const Item& item, JsonText& text) {
    const std::string_view data = item.message->data;
    text.raw(printer.fields.empty() ? ",\"message\":" : ",\"fields\":{");
    if (printer.type != nullptr) {
      const std::string wrong = printer.type->read(data);
      if (wrong.empty()) {
        const google::protobuf::Message& message = printer.type->message();
        if (printer.fields.empty()) return text.message(message);
        for (const FieldPath& path : printer.fields) {
          if (&path != &printer.fields.front()) text.raw(",");
          text.string(path.text());
          text.raw(":");
          text.field(message, path);
        }
        return text.raw("}");
      }
      if (invalid_++ == 0) {
        note(item, "holds messages that are not of their type: lengths only (" + wrong + ")");
      }
      return printer.fields.empty() ? text.bytes(data) : text.raw("}");
    }
    const bool deep = printer.json && nested_deeper(data, kDeepestShown);
    if (printer.json && !deep && nlohmann::json::accept(data)) {
      if (data.find('\n') == std::string_view::npos) return text.raw(data);
      return text.raw(nlohmann::ordered_json::parse(data).dump());
    }
    if (noted_.insert(item.channel).second) {
      const std::string trouble = item.schema == nullptr ? "" : decoder_.trouble(*item.schema);
      note(item, deep ? fmt::format("JSON nested deeper than {}: lengths only", kDeepestShown)
                 : !trouble.empty()
                     ? fmt::format("its definition cannot be read: lengths only ({})", trouble)
                     : fmt::format("'{}' cannot be decoded: lengths only",
                                   item.channel->message_encoding));
    }
    text.bytes(data);
  }

  static void note(const Item& item, std::string_view what) {
    std::cerr << printable(fmt::format("{} ({}): {}", item.channel->topic,
                                       item.schema == nullptr ? "no schema" : item.schema->name,
                                       what))
              << '\n';
  }

  BytesText bytes_;
  const std::vector<std::string>& fields_;
  google::protobuf::LogSilencer silence_;  // errors of a message are reported here
  LogDecoder decoder_;
  std::unordered_map<const log::Channel*, ChannelPrinter> printers_;
  std::set<std::string> found_;
  std::map<std::string, std::set<std::string>> misses_;
  std::set<const log::Channel*> noted_;
  std::uint64_t invalid_ = 0;
};

void to_standard_output(std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(STDOUT_FILENO, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno == EPIPE) throw VerbEnd{"", 0};  // the reader of the pipe has closed it
    if (n < 0) {
      throw VerbEnd{std::string("cannot write to standard output: ") + std::strerror(errno), 1};
    }
    text.remove_prefix(static_cast<std::size_t>(n));
  }
}

/// The bar belongs on the terminal only if nothing else is written there.
bool writes_a_file() {
  struct stat info {};
  return fstat(STDOUT_FILENO, &info) == 0 && S_ISREG(info.st_mode);
}

VerbEnd not_in_log(const std::string& what, const std::string& name,
                   const std::vector<std::string>& known) {
  return {fmt::format("no {} '{}'{}", what, name, runtime::did_you_mean(name, known)), 3};
}

int cat_attachment(const std::vector<OpenLog>& logs, const std::string& name) {
  std::vector<std::string> known;
  int found = 0;
  std::string data;
  for (const OpenLog& log : logs) {
    for (const log::AttachmentIndex& index : log.summary.attachments) {
      known.push_back(index.name);
      if (index.name != name) continue;
      if (const auto read = log::read_attachment(*log.source, index, data); !read) {
        throw VerbEnd{log.path + ": " + read.error().reason, 1};
      }
      ++found;
    }
  }
  if (found == 0) throw not_in_log("attachment", name, known);
  if (found > 1) std::cerr << fmt::format("{} attachments '{}': the last one\n", found, name);
  to_standard_output(data);
  return 0;
}

int cat_metadata(const std::vector<OpenLog>& logs, const std::string& name) {
  std::vector<std::string> known;
  for (const OpenLog& log : logs) {
    for (const log::MetadataIndex& index : log.summary.metadata) known.push_back(index.name);
  }
  if (std::ranges::find(known, name) == known.end()) throw not_in_log("metadata", name, known);
  const std::uint64_t failures = each_metadata(logs, name, [](const log::Metadata& record) {
    to_standard_output(json_text(nlohmann::ordered_json(record.metadata)) + '\n');
  });
  return failures == 0 ? 0 : 1;
}

}  // namespace

int cat_messages(const std::vector<OpenLog>& logs, const CatOptions& options,
                 const TextSink& sink) {
  const LogTimes times = resolve(options.range, span_of(logs));
  const TopicFilter filter = filter_of(options.topics);
  const log::Selection selection{[&](const log::Channel& channel) { return filter(channel.topic); },
                                 times.start, times.end};
  MessagePrinter printer(logs, options, filter);
  log::MergedReader reader = merged(logs, selection);
  std::optional<LogProgress> progress;
  if (writes_a_file()) progress.emplace("cat", logs, selection);
  std::string text;
  std::uint64_t lines = 0;
  const Item* item = nullptr;
  while ((options.limit == 0 || lines < options.limit) && (item = reader.next()) != nullptr) {
    lines += printer.line(*item, text) ? 1 : 0;
    if (text.size() < kTextBuffer) continue;
    sink(text);
    text.clear();
    if (progress) progress->at(item->message->log_time);
  }
  sink(text);
  std::uint64_t damages = printer.invalid();
  for (std::size_t i = 0; i < logs.size(); ++i) {
    damages += report_losses(logs[i], logs[i].summary.damages, logs[i].summary.damage_count);
    damages += report_losses(logs[i], reader.damages(i), reader.damages(i).size());
  }
  return damages == 0 ? 0 : 1;
}

void add_cat(CLI::App& verb, int& exit_code) {
  CLI::App* cat = verb.add_subcommand(
      "cat", "Prints the messages of logs as JSON, one per line (like mcap cat --json)");
  auto o = std::make_shared<CatOptions>();
  cat->add_option("FILE", o->files, "MCAP files: several are one, in the order of log time")
      ->required();
  add_topic_options(*cat, o->topics);
  add_time_options(*cat, o->range);
  cat->add_option("--field", o->fields,
                  "Only this field, such as header.seq or blobs.0.u_px (repeatable)")
      ->allow_extra_args(false);
  cat->add_option("--bytes", o->bytes, "How fields of type bytes look")
      ->check(CLI::IsMember({"length", "base64", "hex"}))
      ->capture_default_str();
  cat->add_option("--limit", o->limit, "Stop after N messages")->check(number_above_zero);
  CLI::Option* attachment = cat->add_option(
      "--attachment", o->attachment, "Print this attachment instead (like mcap get attachment)");
  cat->add_option("--metadata", o->metadata,
                  "Print this metadata record instead (like mcap get metadata)")
      ->excludes(attachment);
  cat->add_flag("--json")->description("JSON is what it prints anyway");
  cat->footer(
      "Examples:\n  mimesis log cat run.mcap --topic planner/status --limit 10 | jq .message\n"
      "  mimesis log cat run.mcap --topic bridge/joint_states --start 12.5 --end 13 --field "
      "position_rad\n"
      "  mimesis log cat run.mcap --attachment imitation.yaml > imitation.yaml");
  on_run(*cat, exit_code, [o] {
    static_cast<void>(filter_of(o->topics));  // reports its errors first
    const auto logs = open_logs(o->files);
    if (!o->attachment.empty()) return cat_attachment(logs, o->attachment);
    if (!o->metadata.empty()) return cat_metadata(logs, o->metadata);
    return cat_messages(logs, *o, to_standard_output);
  });
}

}  // namespace mimesis::tool
