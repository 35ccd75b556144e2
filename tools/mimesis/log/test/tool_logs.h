#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "common/log/stream_reader.h"
#include "common/log/writer.h"
#include "common/runtime/raw.h"
#include "common/testing/temporary_folder.h"
#include "proto/runtime.pb.h"
#include "tools/mimesis/log/cat.h"
#include "tools/mimesis/log/open_log.h"

/// Small logs in files, for the tools that rewrite them.
namespace mimesis::tool::testlogs {

/// A v1.Publication on its way into a log, or out of one.
struct Sent {
  std::string topic;
  std::string node = "n";
  std::uint32_t seq = 0;
  std::uint64_t time = 0;  ///< log time; publish time is one less [ns]
  std::string text = "x";  ///< in the message
  bool latched = false;
  std::string start_id = {};
  bool operator==(const Sent&) const = default;
};

inline std::ostream& operator<<(std::ostream& out, const Sent& s) {
  return out << s.topic << '#' << s.seq << '@' << s.time << '=' << s.text;
}

struct LogOptions {
  std::size_t chunk_size = 256;
  std::vector<log::Metadata> metadata = {};
  std::string attachment = {};
  bool close = true;  ///< false: as a killed recorder leaves it
};

inline std::string log_bytes(const std::vector<Sent>& messages, const LogOptions& options = {}) {
  std::string bytes;
  log::MemorySink sink(bytes);
  log::Writer writer(sink, {.chunk_size = options.chunk_size, .background = false});
  const auto* type = v1::Publication::descriptor();
  const auto schema =
      writer.add_schema(type->full_name(), "protobuf", runtime::descriptor_set(*type));
  std::map<std::tuple<std::string, std::string, std::string>, std::uint16_t> channels;
  for (const Sent& m : messages) {
    auto& id = channels[{m.topic, m.node, m.start_id}];
    if (id == 0) {
      std::map<std::string, std::string> metadata{{"node", m.node},
                                                  {"latched", m.latched ? "true" : "false"}};
      if (!m.start_id.empty()) metadata["start_id"] = m.start_id;
      id = writer.add_channel(*schema, m.topic, "protobuf", metadata).value();
    }
    v1::Publication message;
    message.set_topic(m.text);
    message.set_seq(m.seq);
    const std::string data = message.SerializeAsString();
    EXPECT_TRUE(writer.write({id, m.seq, m.time, m.time - 1, data}));
  }
  if (!options.attachment.empty()) {
    log::Attachment attachment;
    attachment.name = "launch.yaml";
    attachment.data = options.attachment;
    EXPECT_TRUE(writer.attach(attachment));
  }
  for (const log::Metadata& metadata : options.metadata) {
    EXPECT_TRUE(writer.add_metadata(metadata));
  }
  EXPECT_TRUE(options.close ? writer.finish() : writer.flush());
  return bytes;
}

/// The messages of a log in the order of the file; every sum is checked.
inline std::vector<Sent> read_log(const std::string& path) {
  std::vector<Sent> messages;
  const auto source = log::open_file(path);
  if (!source) return messages;
  log::StreamReader reader(**source);
  while (const log::Record* record = reader.next()) {
    const auto* m = std::get_if<log::Message>(record);
    if (m == nullptr) continue;
    const log::Channel& channel = reader.channels().at(m->channel_id);
    v1::Publication message;
    EXPECT_TRUE(message.ParseFromArray(m->data.data(), static_cast<int>(m->data.size())));
    const auto value = [&](const std::string& key) {
      const auto it = channel.metadata.find(key);
      return it == channel.metadata.end() ? "" : it->second;
    };
    messages.push_back({channel.topic, value("node"), m->sequence, m->log_time, message.topic(),
                        value("latched") == "true", value("start_id")});
  }
  EXPECT_EQ(reader.damage_count(), 0u);
  EXPECT_TRUE(reader.complete());
  return messages;
}

/// A folder of its own for each test.
class ToolLogs : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string save(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
    return path(name);
  }
  std::string bytes_of(const std::string& name) const {
    std::ifstream in(path(name), std::ios::binary);
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
  }
  /// Names in the folder, sorted.
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) {
      names.push_back(entry.path().filename().string());
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  /// What `log cat` prints, a line each.
  std::vector<nlohmann::ordered_json> cat(const CatOptions& options, int code = 0) {
    std::string text;
    const auto logs = open_logs(options.files);
    EXPECT_EQ(cat_messages(logs, options, [&](std::string_view part) { text += part; }), code);
    std::vector<nlohmann::ordered_json> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
      lines.push_back(nlohmann::ordered_json::parse(line));
    return lines;
  }

 private:
  testing::TemporaryFolder folder_;
};

}  // namespace mimesis::tool::testlogs
