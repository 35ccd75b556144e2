#include "tools/mimesis/log/cat.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/stubs/logging.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <unordered_map>

#include "common/runtime/raw.h"
#include "common/runtime/suggest.h"
#include "tools/mimesis/log/rewriting.h"
#include "tools/mimesis/progress.h"

namespace mimesis::tool {
namespace {

using log::Result;
using Item = log::MergedReader::Item;

constexpr std::size_t kBuffer = 64 * 1024;  // of text per write

/// How the messages of one channel become text.
struct Printer {
  std::string head;                                    ///< up to the sequence number
  std::unique_ptr<google::protobuf::Message> message;  ///< filled again and again; null: foreign
  std::vector<FieldPath> fields;
  bool json = false;     ///< the payload itself is JSON
  bool skipped = false;  ///< has none of the fields
};

class Cat {
 public:
  Cat(const std::vector<OpenLog>& logs, const CatOptions& options) : options_(options) {
    for (const OpenLog& log : logs) {
      for (const auto& [id, channel] : log.summary.channels) {
        if (!options_.filter(channel.topic)) continue;
        const auto schema = log.summary.schemas.find(channel.schema_id);
        add(channel, schema == log.summary.schemas.end() ? nullptr : &schema->second);
      }
    }
    check_fields();
  }

  /// Appends a line; false if the message has nothing to show.
  bool line(const Item& item, std::string& out) {
    Printer& printer = printers_.at(item.channel);
    if (printer.skipped) return false;
    JsonText text(out, options_.bytes);
    const log::Message& m = *item.message;
    text.raw(printer.head);
    text.integer(m.sequence);
    text.raw(",\"log_time_ns\":");
    text.integer(m.log_time);
    text.raw(",\"publish_time_ns\":");
    text.integer(m.publish_time);
    payload(printer, item, text, out);
    out += "}\n";
    return true;
  }
  std::uint64_t invalid() const { return invalid_; }  ///< messages that are not of their type

 private:
  void add(const log::Channel& channel, const log::Schema* schema) {
    Printer& printer = printers_[&channel];
    JsonText head(printer.head, options_.bytes);
    head.raw("{\"topic\":");
    head.string(channel.topic);
    head.raw(",\"node\":");
    head.string(sender_of(channel));
    head.raw(",\"seq\":");
    printer.json = channel.message_encoding == "json";
    if (channel.message_encoding == "protobuf" && schema != nullptr) {
      printer.message = types_.make(schema->name, schema->data);
    }
    resolve_fields(printer);
  }

  void resolve_fields(Printer& printer) {
    for (const std::string& path : options_.fields) {
      if (!printer.message) continue;
      try {
        printer.fields.emplace_back(*printer.message->GetDescriptor(), path);
        found_.insert(path);
      } catch (const ConfigError& e) {
        misses_[path].insert(e.what());
      }
    }
    printer.skipped = !options_.fields.empty() && printer.fields.empty();
  }

  /// A field that no selected topic has is a mistake; with one type it is known which.
  void check_fields() const {
    for (const auto& [path, reasons] : misses_) {
      if (found_.contains(path)) continue;
      throw ConfigError(reasons.size() == 1
                            ? *reasons.begin()
                            : fmt::format("no selected topic has a field '{}'", path));
    }
  }

  void payload(Printer& printer, const Item& item, JsonText& text, std::string& out) {
    const std::string_view data = item.message->data;
    text.raw(printer.fields.empty() ? ",\"message\":" : ",\"fields\":{");
    if (printer.message) {
      if (printer.message->ParseFromArray(data.data(), static_cast<int>(data.size()))) {
        if (printer.fields.empty()) return text.message(*printer.message);
        for (const FieldPath& path : printer.fields) {
          if (&path != &printer.fields.front()) out += ',';
          text.string(path.text());
          out += ':';
          text.field(*printer.message, path);
        }
        out += '}';
        return;
      }
      if (invalid_++ == 0) note(item, "holds messages that are not of their type: lengths only");
      if (!printer.fields.empty()) return text.raw("}");
      return text.bytes(data);
    }
    if (printer.json && nlohmann::json::accept(data)) {
      if (data.find('\n') == std::string_view::npos) return text.raw(data);
      return text.raw(nlohmann::ordered_json::parse(data).dump());
    }
    if (noted_.insert(item.channel).second) {
      note(item,
           fmt::format("'{}' cannot be decoded: lengths only", item.channel->message_encoding));
    }
    text.bytes(data);
  }

  void note(const Item& item, std::string_view what) const {
    std::cerr << fmt::format("{} ({}): {}\n", item.channel->topic,
                             item.schema == nullptr ? "no schema" : item.schema->name, what);
  }

  const CatOptions& options_;
  google::protobuf::LogSilencer silence_;  // what is wrong with a message is told here
  runtime::TypePool types_;                // before the messages that it makes
  std::unordered_map<const log::Channel*, Printer> printers_;
  std::set<std::string> found_;
  std::map<std::string, std::set<std::string>> misses_;
  std::set<const log::Channel*> noted_;
  std::uint64_t invalid_ = 0;
};

Result to_standard_output(std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(STDOUT_FILENO, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return tl::unexpected(Status{errno == EPIPE ? "" : std::strerror(errno)});
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return {};
}

/// The bar belongs on the terminal only if nobody else writes there.
bool writes_a_file() {
  struct stat info {};
  return fstat(STDOUT_FILENO, &info) == 0 && S_ISREG(info.st_mode);
}

int not_found(const std::string& what, const std::string& name,
              const std::vector<std::string>& known) {
  std::cerr << fmt::format("no {} '{}'{}\n", what, name, runtime::did_you_mean(name, known));
  return 3;
}

tl::expected<int, Status> cat_attachment(const std::vector<OpenLog>& logs, const std::string& name,
                                         const TextSink& sink) {
  std::vector<std::string> known;
  int found = 0;
  std::string data;
  for (const OpenLog& log : logs) {
    for (const log::AttachmentIndex& index : log.summary.attachments) {
      known.push_back(index.name);
      if (index.name != name) continue;
      if (const auto read = log::read_attachment(*log.source, index, data); !read) {
        std::cerr << log.path << ": " << read.error().reason << '\n';
        return 1;
      }
      ++found;
    }
  }
  if (found == 0) return not_found("attachment", name, known);
  if (found > 1) std::cerr << fmt::format("{} attachments '{}': the last one\n", found, name);
  if (auto done = sink(data); !done) return tl::unexpected(done.error());
  return 0;
}

tl::expected<int, Status> cat_metadata(const std::vector<OpenLog>& logs, const std::string& name,
                                       const TextSink& sink) {
  std::vector<std::string> known;
  bool found = false;
  for (const OpenLog& log : logs) {
    for (const log::MetadataIndex& index : log.summary.metadata) {
      known.push_back(index.name);
      if (index.name != name) continue;
      const auto read = log::read_metadata(*log.source, index);
      if (!read) {
        std::cerr << log.path << ": " << read.error().reason << '\n';
        return 1;
      }
      found = true;
      std::string line = "{";
      JsonText text(line, BytesText::length);
      for (const auto& [key, value] : read->metadata) {
        if (line.size() > 1) line += ',';
        text.string(key);
        line += ':';
        text.string(value);
      }
      if (auto done = sink(line + "}\n"); !done) return tl::unexpected(done.error());
    }
  }
  return found ? 0 : not_found("metadata", name, known);
}

}  // namespace

tl::expected<int, Status> cat_messages(const std::vector<OpenLog>& logs, const CatOptions& options,
                                       const TextSink& sink) {
  const LogTimes times = resolve(options.range, span_of(logs));
  const log::Selection selection{
      [&](const log::Channel& channel) { return options.filter(channel.topic); }, times.start,
      times.end};
  Cat cat(logs, options);
  log::MergedReader reader = merged(logs, selection);
  Progress progress("cat", writes_a_file() ? payload_bytes(logs, selection) : 0);
  std::string text;
  std::uint64_t lines = 0, bytes = 0;
  const log::MergedReader::Item* item = nullptr;
  while ((options.limit == 0 || lines < options.limit) && (item = reader.next()) != nullptr) {
    lines += cat.line(*item, text) ? 1 : 0;
    bytes += item->message->data.size();
    if (text.size() < kBuffer) continue;
    if (auto done = sink(text); !done) return tl::unexpected(done.error());
    text.clear();
    if (writes_a_file()) progress.at(bytes);
  }
  if (auto done = sink(text); !done) return tl::unexpected(done.error());
  std::uint64_t damages = cat.invalid();
  for (std::size_t i = 0; i < logs.size(); ++i) {
    damages += report_losses(logs[i], logs[i].summary.damages, logs[i].summary.damage_count);
    damages += report_losses(logs[i], reader.damages(i), reader.damages(i).size());
  }
  return damages == 0 ? 0 : 1;
}

int log_cat(const CatOptions& options) {
  const auto logs = open_logs(options.files);
  if (!logs) {
    std::cerr << logs.error().line << '\n';
    return logs.error().exit_code;
  }
  const auto code =
      !options.attachment.empty() ? cat_attachment(*logs, options.attachment, to_standard_output)
      : !options.metadata.empty() ? cat_metadata(*logs, options.metadata, to_standard_output)
                                  : cat_messages(*logs, options, to_standard_output);
  if (code) return *code;
  if (code.error().reason.empty()) return 0;  // whoever read the pipe has had enough
  std::cerr << "cannot write to standard output: " << code.error().reason << '\n';
  return 1;
}

}  // namespace mimesis::tool
