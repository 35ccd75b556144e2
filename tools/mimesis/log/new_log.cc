#include "tools/mimesis/log/new_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/error.h"
#include "common/log/codec.h"
#include "tools/mimesis/log/verb_options.h"
#include "tools/mimesis/stop_signals.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostOverlap = 2ull << 30;   // held unpacked at once [bytes]
constexpr const char* kNodesName = "mimesis.nodes";  // name -> clock
/// Position of a part in a split recording: void for logs made of several parts.
constexpr const char *kPlaceName = "mimesis.split", *kWholeName = "mimesis.counts.whole";

/// A device or pipe (/dev/null) is written to as it is.
bool is_device(const std::string& path) {
  std::error_code ignored;
  const auto status = fs::status(path, ignored);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

std::uint32_t digest(std::uint32_t digest, const log::Message& m) {
  struct {
    std::uint64_t log_time, publish_time;
    std::uint32_t sequence, channel_id;
  } const head{m.log_time, m.publish_time, m.sequence, m.channel_id};
  digest = log::crc32(digest, {reinterpret_cast<const char*>(&head), sizeof head});
  return log::crc32(digest, m.data);
}

std::vector<std::string> paths_of(const std::vector<OpenLog>& logs) {
  std::vector<std::string> paths;
  for (const OpenLog& log : logs) paths.push_back(log.path);
  return paths;
}

/// Profile that all logs share, or "".
std::string common_profile(const std::vector<OpenLog>& logs) {
  std::set<std::string> profiles;
  for (const OpenLog& log : logs) profiles.insert(log.summary.header.profile);
  return profiles.size() == 1 ? *profiles.begin() : "";
}

/// Signals while an output is written.
class WritingStop {
 public:
  explicit WritingStop(const std::string& path) : path_(path) {}
  /// @throws VerbEnd
  void check() const {
    if (stop_.requested()) throw VerbEnd{"interrupted: '" + path_ + "' was not written", 130};
  }

 private:
  const std::string& path_;
  const StopSignals stop_;
};

}  // namespace

void check_output(const OutputOptions& options, const std::vector<std::string>& inputs) {
  std::error_code ignored;
  if (options.path.empty()) throw ConfigError("say where to: -o FILE");
  for (const std::string& input : inputs) {
    if (fs::equivalent(input, options.path, ignored)) {
      throw ConfigError(fmt::format("'{}' is an input: give the output another name", input));
    }
  }
  if (fs::is_directory(options.path, ignored)) {
    throw ConfigError(fmt::format("'{}' is a folder: expected a file to write", options.path));
  }
  if (!options.force && !is_device(options.path) && fs::exists(options.path, ignored)) {
    throw ConfigError(fmt::format("'{}' exists: --force replaces it", options.path));
  }
}

NewLog::NewLog(const OutputOptions& options, const std::vector<OpenLog>& inputs)
    : NewLog(options, paths_of(inputs), common_profile(inputs)) {}

NewLog::NewLog(const OutputOptions& options, const std::vector<std::string>& inputs,
               const std::string& profile)
    : options_(options) {
  check_output(options_, inputs);
  written_to_ = options_.path + (is_device(options_.path) ? "" : ".part");
  auto sink = log::create_file(written_to_);
  if (!sink) throw ConfigError(sink.error().reason);
  sink_ = std::move(*sink);
  writer_ = std::make_unique<log::Writer>(*sink_,
                                          log::WriterOptions{.profile = profile,
                                                             .library = "mimesis " MIMESIS_VERSION,
                                                             .compression = options_.compression,
                                                             .zstd_level = options_.zstd_level,
                                                             .chunk_size = options_.chunk_size});
}

NewLog::~NewLog() {
  if (!finished_ && written_to_ != options_.path) std::remove(written_to_.c_str());
}

template <class T>
T NewLog::written(tl::expected<T, Status> result) const {
  if (!result) {
    const std::string& reason = result.error().reason;
    throw NotWritten{{fmt::format("{}; '{}' was not written", reason, options_.path), 1}, reason};
  }
  if constexpr (!std::is_void_v<T>) return *result;
}

std::uint16_t NewLog::channel(const log::Channel& channel, const log::Schema* schema) {
  std::uint16_t schema_id = 0;
  if (schema != nullptr) {
    const auto [known, fresh] =
        schemas_.try_emplace({schema->name, schema->encoding, schema->data}, 0);
    if (fresh) {
      known->second = written(writer_->add_schema(schema->name, schema->encoding, schema->data));
      if (!schema_names_.insert(schema->name).second) conflicts_.insert(schema->name);
    }
    schema_id = known->second;
  }
  const auto [known, fresh] = channels_.try_emplace(
      {schema_id, channel.topic, channel.message_encoding, channel.metadata}, 0);
  if (fresh) {
    known->second = written(
        writer_->add_channel(schema_id, channel.topic, channel.message_encoding, channel.metadata));
  }
  return known->second;
}

void NewLog::write(const log::Message& message) {
  digest_ = digest(digest_, message);
  written(writer_->write(message));
}

void NewLog::copy(const Item& item) {
  const auto [known, fresh] = known_.try_emplace(item.channel, 0);
  if (fresh) known->second = channel(*item.channel, item.schema);
  log::Message message = *item.message;
  message.channel_id = known->second;
  write(message);
}

void NewLog::attach(const log::Attachment& a) {
  const bool fresh = attachments_
                         .emplace(a.name, a.media_type, a.log_time, a.create_time, a.data.size(),
                                  log::crc32(0, a.data))
                         .second;
  if (fresh) written(writer_->attach(a));
}

void NewLog::add_metadata(const log::Metadata& metadata) {
  if (!metadata_.emplace(metadata.name, metadata.metadata).second) return;
  written(writer_->add_metadata(metadata));
}

void NewLog::count_damages(const OpenLog& log) {
  damages_ += report_losses(log, log.summary.damages, log.summary.damage_count);
}

void NewLog::read(const std::string& what, const std::vector<OpenLog>& logs,
                  const log::Selection& selection, const std::function<void(const Item&)>& take,
                  const std::vector<std::int64_t>& offsets_ns) {
  for (const OpenLog& log : logs) {
    if (const auto bytes = overlap_bytes(log.summary); bytes > kMostOverlap) {
      throw ConfigError(
          fmt::format("{}: its messages are so far out of order that {} would be held "
                      "in memory: run 'mcap sort' first",
                      log.path, bytes_text(bytes)));
    }
    count_damages(log);
  }
  const WritingStop stop(options_.path);
  LogProgress progress(what, logs, selection);
  auto reader = merged(logs, selection, offsets_ns);
  while (const Item* item = reader.next()) {
    stop.check();
    take(*item);
    progress.at(item->message->log_time);
  }
  for (std::size_t i = 0; i < logs.size(); ++i) {
    damages_ += report_losses(logs[i], reader.damages(i), reader.damages(i).size());
  }
}

void NewLog::read(const std::string& what, const log::Source& source, log::StreamReader& reader,
                  const std::function<void(const log::Record&)>& take) {
  const WritingStop stop(options_.path);
  Progress progress(what, source.size());
  while (const log::Record* record = reader.next()) {
    stop.check();
    take(*record);
    progress.at(reader.offset());
  }
}

void NewLog::copy_attachments(const std::vector<OpenLog>& logs) {
  for (const OpenLog& log : logs) {
    for (const log::AttachmentIndex& index : log.summary.attachments) {
      std::string data;
      if (const auto attachment = log::read_attachment(*log.source, index, data)) {
        attach(*attachment);
      } else {
        std::cerr << log.path << ": " << printable(attachment.error().reason) << '\n';
        ++damages_;
      }
    }
  }
}

void NewLog::copy_metadata(const std::vector<OpenLog>& logs,
                           const std::optional<LossCounts>& losses) {
  log::Metadata nodes{kNodesName, {}};
  damages_ += each_metadata(logs, "", [&](const log::Metadata& m) {
    if (m.name == kNodesName) return nodes.metadata.insert(m.metadata.begin(), m.metadata.end());
    const bool void_now = (losses && m.name == kCountsName) ||
                          (logs.size() > 1 && (m.name == kPlaceName || m.name == kWholeName));
    if (!void_now) add_metadata(m);
  });
  if (!nodes.metadata.empty()) add_metadata(nodes);
  if (losses) add_metadata(losses_metadata(*losses));
}

void NewLog::finish(bool verify) {
  written(writer_->finish());
  if (verify) read_back();
  if (written_to_ != options_.path &&
      std::rename(written_to_.c_str(), options_.path.c_str()) != 0) {
    written(log::Result(tl::unexpected(
        Status{fmt::format("cannot rename '{}': {}", written_to_, std::strerror(errno))})));
  }
  finished_ = true;
}

void NewLog::read_back() const {
  const auto failed = [&](const std::string& why) {
    written(log::Result(
        tl::unexpected(Status{fmt::format("'{}' reads back wrong: {}", written_to_, why)})));
  };
  const auto source = log::open_file(written_to_);
  if (!source) return failed(source.error().reason);
  log::StreamReader reader(**source);
  std::uint64_t messages = 0;
  std::uint32_t read_digest = 0;
  while (const log::Record* record = reader.next()) {
    const auto* message = std::get_if<log::Message>(record);
    if (message == nullptr) continue;
    ++messages;
    read_digest = digest(read_digest, *message);
  }
  if (reader.damage_count() > 0) return failed(reader.damages().front().what);
  if (messages != statistics().message_count || read_digest != digest_) {
    failed("its messages are not those that were written");
  }
}

nlohmann::ordered_json NewLog::json() const {
  const log::Statistics& s = statistics();
  return {{"file", options_.path},        {"messages", s.message_count},
          {"channels", s.channel_count},  {"attachments", s.attachment_count},
          {"metadata", s.metadata_count}, {"start_ns", s.message_start_time},
          {"end_ns", s.message_end_time}, {"bytes", writer_->bytes_written()}};
}

std::string NewLog::line() const {
  const log::Statistics& s = statistics();
  return fmt::format("{}: {} messages on {} channels, {:.3f} s, {}", options_.path, s.message_count,
                     s.channel_count,
                     static_cast<double>(s.message_end_time - s.message_start_time) * 1e-9,
                     bytes_text(writer_->bytes_written()));
}

int NewLog::conclude(bool json, const nlohmann::ordered_json& more) {
  finish();
  std::cerr << line() << '\n';
  if (json) {
    auto object = this->json();
    object["damages"] = damages_;
    object.update(more);
    print_json(object);
  }
  return damages_ == 0 ? 0 : 1;
}

}  // namespace mimesis::tool
