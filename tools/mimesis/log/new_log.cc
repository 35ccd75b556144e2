#include "tools/mimesis/log/new_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iostream>

#include "common/error.h"
#include "common/log/crc32.h"
#include "common/log/stream_reader.h"
#include "tools/mimesis/log/human.h"
#include "tools/mimesis/log/verb_options.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

constexpr int kInterrupted = 130;
constexpr const char* kNodesName = "mimesis.nodes";  // name -> clock
/// Where a part stands in a split recording: void for what is made of several parts.
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

NewLog::NewLog(const OutputOptions& options, const std::vector<std::string>& inputs)
    : options_(options) {
  check_output(options_, inputs);
  written_to_ = options_.path + (is_device(options_.path) ? "" : ".part");
  auto sink = log::create_file(written_to_);
  if (!sink) throw ConfigError(sink.error().reason);
  sink_ = std::move(*sink);
  log::WriterOptions writer_options;
  writer_options.profile = options_.profile;
  writer_options.library = "mimesis " MIMESIS_VERSION;
  writer_options.compression = options_.compression;
  writer_options.zstd_level = options_.zstd_level;
  writer_options.chunk_size = options_.chunk_size;
  writer_ = std::make_unique<log::Writer>(*sink_, writer_options);
}

NewLog::~NewLog() {
  if (!finished_ && written_to_ != options_.path) std::remove(written_to_.c_str());
}

tl::expected<std::uint16_t, Status> NewLog::channel(const log::Channel& channel,
                                                    const log::Schema* schema) {
  std::uint16_t schema_id = 0;
  if (schema != nullptr) {
    std::tuple key{schema->name, schema->encoding, schema->data};
    const auto known = schemas_.find(key);
    if (known == schemas_.end()) {
      const auto id = writer_->add_schema(schema->name, schema->encoding, schema->data);
      if (!id) return id;
      if (!schema_names_.insert(schema->name).second) conflicts_.insert(schema->name);
      schema_id = schemas_.emplace(std::move(key), *id).first->second;
    } else {
      schema_id = known->second;
    }
  }
  ChannelKey key{schema_id, channel.topic, channel.message_encoding, channel.metadata};
  if (const auto known = channels_.find(key); known != channels_.end()) return known->second;
  const auto id =
      writer_->add_channel(schema_id, channel.topic, channel.message_encoding, channel.metadata);
  if (id) channels_.emplace(std::move(key), *id);
  return id;
}

log::Result NewLog::write(const log::Message& message) {
  digest_ = digest(digest_, message);
  return writer_->write(message);
}

log::Result NewLog::copy(const Item& item) {
  auto known = known_.find(item.channel);
  if (known == known_.end()) {
    const auto id = channel(*item.channel, item.schema);
    if (!id) return tl::unexpected(id.error());
    known = known_.emplace(item.channel, *id).first;
  }
  log::Message message = *item.message;
  message.channel_id = known->second;
  return write(message);
}

log::Result NewLog::attach(const log::Attachment& attachment) {
  if (!attachments_
           .emplace(attachment.name, attachment.media_type, attachment.log_time,
                    attachment.create_time, attachment.data.size(), log::crc32(0, attachment.data))
           .second) {
    return {};
  }
  return writer_->attach(attachment);
}

log::Result NewLog::add_metadata(const log::Metadata& metadata) {
  if (!metadata_.emplace(metadata.name, metadata.metadata).second) return {};
  return writer_->add_metadata(metadata);
}

log::Result NewLog::finish(bool verify) {
  if (auto done = writer_->finish(); !done) return done;
  if (verify) {
    if (auto done = read_back(); !done) return done;
  }
  if (written_to_ != options_.path &&
      std::rename(written_to_.c_str(), options_.path.c_str()) != 0) {
    return tl::unexpected(
        Status{fmt::format("cannot rename '{}': {}", written_to_, std::strerror(errno))});
  }
  finished_ = true;
  return {};
}

log::Result NewLog::read_back() const {
  const auto failed = [&](const std::string& why) {
    return tl::unexpected(Status{fmt::format("'{}' reads back wrong: {}", written_to_, why)});
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
    return failed("its messages are not those that were written");
  }
  return {};
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

std::string common_profile(const std::vector<OpenLog>& logs) {
  if (logs.empty()) return "";
  const std::string& first = logs.front().summary.header.profile;
  const bool same = std::ranges::all_of(
      logs, [&](const OpenLog& log) { return log.summary.header.profile == first; });
  return same ? first : "";
}

void copy_attachments(const std::vector<OpenLog>& logs, NewLog& out, Pass& pass) {
  for (const OpenLog& log : logs) {
    for (const log::AttachmentIndex& index : log.summary.attachments) {
      if (!pass.done || pass.interrupted) return;
      std::string data;
      if (const auto attachment = log::read_attachment(*log.source, index, data)) {
        pass.done = out.attach(*attachment);
      } else {
        std::cerr << log.path << ": " << attachment.error().reason << '\n';
        ++pass.damages;
      }
    }
  }
}

void copy_metadata(const std::vector<OpenLog>& logs, NewLog& out, Pass& pass,
                   const std::optional<LossCounts>& losses) {
  if (!pass.done || pass.interrupted) return;
  log::Metadata nodes{kNodesName, {}};
  pass.damages += each_metadata(logs, "", [&](const log::Metadata& m) {
    const bool void_now = (losses && m.name == kCountsName) ||
                          (logs.size() > 1 && (m.name == kPlaceName || m.name == kWholeName));
    if (!pass.done || void_now) return;
    if (m.name == kNodesName) {
      nodes.metadata.insert(m.metadata.begin(), m.metadata.end());
    } else {
      pass.done = out.add_metadata(m);
    }
  });
  if (pass.done && !nodes.metadata.empty()) pass.done = out.add_metadata(nodes);
  if (pass.done && losses) pass.done = out.add_metadata(losses_metadata(*losses));
}

int conclude(NewLog& out, Pass& pass, bool json, const nlohmann::ordered_json& more) {
  if (pass.interrupted) {
    std::cerr << "interrupted: '" << out.path() << "' was not written\n";
    return kInterrupted;
  }
  if (pass.done) pass.done = out.finish();
  if (!pass.done) {
    std::cerr << pass.done.error().reason << "; '" << out.path() << "' was not written\n";
    return 1;
  }
  std::cerr << out.line() << '\n';
  if (json) {
    auto object = out.json();
    object["damages"] = pass.damages;
    object.update(more);
    print_json(object);
  }
  return pass.damages == 0 ? 0 : 1;
}

}  // namespace mimesis::tool
