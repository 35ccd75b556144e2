// Our logs in the format's reference reader (npm @mcap/core), and its logs in ours.
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "common/log/indexed_reader.h"
#include "common/log/writer.h"

namespace mimesis::log {
namespace {

namespace fs = std::filesystem;

struct Ran {
  int status = -1;
  std::string output;  ///< without the last newline
};

Ran run(const std::string& command) {
  Ran ran;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return ran;
  std::array<char, 4096> buffer;
  for (std::size_t n; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
    ran.output.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  ran.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  if (ran.output.ends_with('\n')) ran.output.pop_back();
  return ran;
}

class McapPeer : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string install = MIMESIS_SOURCE_DIR "/tests/peer/install " MIMESIS_BIN_DIR "/..";
    const Ran modules = run(install);
    if (modules.status != 0) GTEST_SKIP() << "no reference reader: " << modules.output;
    setenv("NODE_PATH", modules.output.c_str(), 1);
    std::string name = (fs::temp_directory_path() / "mimesis-peer-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  nlohmann::json read_with_peer(const fs::path& file) {
    const Ran ran =
        run("node " MIMESIS_SOURCE_DIR "/tests/peer/read_mcap.js '" + file.string() + "'");
    EXPECT_EQ(ran.status, 0);
    return nlohmann::json::parse(ran.output, nullptr, false);
  }
  fs::path folder_;
};

TEST_F(McapPeer, ReadsOurLogsOfAllCodecsWithEveryChecksum) {
  for (const Compression codec : {Compression::none, Compression::lz4, Compression::zstd}) {
    for (const std::size_t chunk_size : {0, 2000, 1 << 20}) {
      const fs::path file = folder_ / "ours.mcap";
      auto sink = create_file(file.string());
      ASSERT_TRUE(sink);
      Writer writer(**sink, {.compression = codec, .chunk_size = chunk_size});
      std::map<std::string, int> counts;
      ASSERT_TRUE(writer.add_schema("test.Type", "protobuf", std::string(300, 'd')));
      for (const char* topic : {"a/out", "b/out", "c/out"}) {
        ASSERT_TRUE(
            writer.add_channel(1, topic, "protobuf", {{"node", "a"}, {"latched", "false"}}));
        counts[topic] = 0;
      }
      for (std::uint32_t i = 0; i < 3000; ++i) {
        const auto id = static_cast<std::uint16_t>(1 + i * i % 3);
        const std::string data = "payload " + std::to_string(i * 2654435761u);
        const std::uint64_t time = 1000 + (i ^ 3);  // neighbours out of order
        ASSERT_TRUE(writer.write({id, i, time, time, data}));
        ++counts[std::next(counts.begin(), id - 1)->first];
      }
      Attachment attachment;
      attachment.name = "launch.yaml";
      attachment.data = "nodes: {}";
      ASSERT_TRUE(writer.attach(attachment));
      ASSERT_TRUE(writer.add_metadata({"mimesis.counts", {{"total", "lost=0"}}}));
      ASSERT_TRUE(writer.finish());
      std::erase_if(counts, [](const auto& c) { return c.second == 0; });

      const nlohmann::json peer = read_with_peer(file);
      ASSERT_TRUE(peer.is_object());
      EXPECT_TRUE(peer["done"]);
      EXPECT_EQ(peer["streamed"], nlohmann::json(counts));
      if (chunk_size > 0) {  // the reference cannot seek in files without chunks
        EXPECT_EQ(peer["indexed"], nlohmann::json(counts));
        EXPECT_TRUE(peer["ordered"]);
      }
      EXPECT_EQ(peer["schemas"]["test.Type"], 300);
      EXPECT_EQ(peer["attachments"], 1);
      EXPECT_EQ(peer["metadata"], 1);
    }
  }
}

TEST_F(McapPeer, WritesLogsThatWeRead) {
  const fs::path file = folder_ / "theirs.mcap";
  ASSERT_EQ(
      run("node " MIMESIS_SOURCE_DIR "/tests/peer/write_mcap.js '" + file.string() + "'").status,
      0);
  const auto source = open_file(file.string());
  ASSERT_TRUE(source);
  const auto summary = summarize(**source);
  ASSERT_TRUE(summary);
  EXPECT_TRUE(summary->from_file);
  EXPECT_EQ(summary->channels.size(), 2u);
  IndexedReader reader(**source, *summary);
  std::uint32_t i = 0;
  while (const Message* m = reader.next()) {
    EXPECT_EQ(m->data, "{\"i\":" + std::to_string(i) + "}");
    EXPECT_EQ(m->sequence, i++);
  }
  EXPECT_EQ(i, 500u);
  StreamReader stream(**source);
  while (stream.next() != nullptr) continue;
  EXPECT_EQ(stream.damage_count(), 0u);
}

}  // namespace
}  // namespace mimesis::log
