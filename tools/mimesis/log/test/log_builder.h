#pragma once
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "common/log/writer.h"
#include "common/runtime/raw.h"
#include "common/testing/temporary_folder.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// A small log, made by hand.
class LogBuilder {
 public:
  explicit LogBuilder(log::WriterOptions options = {}) : writer_(sink_, std::move(options)) {}

  /// Adds a message; `sequence` counts per topic and node unless given.
  template <class M>
  LogBuilder& add(const std::string& topic, std::uint64_t log_time_ns, const M& message,
                  std::uint32_t sequence = 0, const std::string& node = "node") {
    const auto* type = M::descriptor();
    auto& schema = schemas_[type->full_name()];
    if (schema == 0) {
      schema =
          writer_.add_schema(type->full_name(), "protobuf", runtime::descriptor_set(*type)).value();
    }
    return add_bytes(topic, log_time_ns, message.SerializeAsString(), sequence, node, schema,
                     "protobuf");
  }

  LogBuilder& add_bytes(const std::string& topic, std::uint64_t log_time_ns,
                        const std::string& bytes, std::uint32_t sequence = 0,
                        const std::string& node = "node", std::uint16_t schema = 0,
                        const std::string& encoding = "raw") {
    auto& channel = channels_[{topic, node}];
    if (channel.id == 0) {
      channel.id = writer_.add_channel(schema, topic, encoding, {{"node", node}}).value();
    }
    channel.sequence = sequence != 0 ? sequence : channel.sequence + 1;
    EXPECT_TRUE(writer_.write({channel.id, channel.sequence, log_time_ns,
                               log_time_ns == 0 ? 0 : log_time_ns - 1, bytes}));
    return *this;
  }

  log::Writer& writer() { return writer_; }
  std::string finish() {
    EXPECT_TRUE(writer_.finish());
    return bytes_;
  }
  /// In memory, as if it had been opened.
  OpenLog open(const std::string& path = "test.mcap") {
    finish();
    auto source = std::make_unique<log::MemorySource>(bytes_);
    auto summary = log::summarize(*source).value();
    return {path, std::move(source), std::move(summary)};
  }

 private:
  struct Channel {
    std::uint16_t id = 0;
    std::uint32_t sequence = 0;
  };
  std::string bytes_;
  log::MemorySink sink_{bytes_};
  log::Writer writer_;
  std::map<std::string, std::uint16_t> schemas_;
  std::map<std::pair<std::string, std::string>, Channel> channels_;
};

/// A folder for one test.
class TestFolder {
 public:
  std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(path_ / name, std::ios::binary) << content;
    return file(name);
  }
  std::string read(const std::string& name) const {
    std::ifstream in(path_ / name, std::ios::binary);
    EXPECT_TRUE(in) << name;
    std::ostringstream all;
    all << in.rdbuf();
    return all.str();
  }
  std::filesystem::path path() const { return path_; }

 private:
  testing::TemporaryFolder path_;
};

}  // namespace mimesis::tool
