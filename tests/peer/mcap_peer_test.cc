// Our files in the format's reference reader (npm @mcap/core), and its files in ours.
#include <nlohmann/json.hpp>

#include "common/log/writer.h"
#include "tests/peer/foreign.h"

namespace mimesis::peer {
namespace {

using log::Compression;

class McapPeer : public Foreign {};

TEST_F(McapPeer, ReadsOurLogsOfAllCodecsWithEveryChecksum) {
  for (const Compression codec : {Compression::none, Compression::lz4, Compression::zstd}) {
    for (const std::size_t chunk_size : {0, 2000, 1 << 20}) {
      const fs::path file = folder_ / "ours.mcap";
      auto sink = log::create_file(file.string());
      ASSERT_TRUE(sink);
      log::Writer writer(**sink, {.compression = codec, .chunk_size = chunk_size});
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
      log::Attachment attachment;
      attachment.name = "launch.yaml";
      attachment.data = "nodes: {}";
      ASSERT_TRUE(writer.attach(attachment));
      ASSERT_TRUE(writer.add_metadata({"mimesis.counts", {{"total", "lost=0"}}}));
      ASSERT_TRUE(writer.finish());
      std::erase_if(counts, [](const auto& c) { return c.second == 0; });

      const nlohmann::json read = read_with_peer({file});
      ASSERT_EQ(read.size(), 1u);
      const nlohmann::json& peer = read[0];
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
  const bool has_lz4 = run("command -v lz4").status == 0;
  for (const std::string codec : {"none", "zstd", "lz4"}) {
    if (codec == "lz4" && !has_lz4) continue;
    const fs::path file = folder_ / "theirs.mcap";
    ASSERT_EQ(run_script("write_mcap.js", "'" + file.string() + "' " + codec).status, 0);
    const auto source = log::open_file(file.string());
    ASSERT_TRUE(source);
    const auto summary = log::summarize(**source);
    ASSERT_TRUE(summary);
    EXPECT_TRUE(summary->from_file);
    EXPECT_EQ(summary->channels.size(), 2u);
    ASSERT_FALSE(summary->segments.empty());
    EXPECT_EQ(summary->segments[0].index.compression, codec == "none" ? "" : codec);
    log::IndexedReader reader(**source, *summary);
    std::uint32_t i = 0;
    while (const log::Message* m = reader.next()) {
      EXPECT_EQ(m->data, "{\"i\":" + std::to_string(i) + "}");
      EXPECT_EQ(m->sequence, i++);
    }
    EXPECT_EQ(i, 500u);
    std::string note;
    ASSERT_EQ(summary->attachments.size(), 1u);
    const auto attachment = log::read_attachment(**source, summary->attachments[0], note);
    ASSERT_TRUE(attachment);
    EXPECT_EQ(attachment->data, "from the peer");
    ASSERT_EQ(summary->metadata.size(), 1u);
    EXPECT_EQ(log::read_metadata(**source, summary->metadata[0])->metadata.at("codec"), codec);
    log::StreamReader stream(**source);
    while (stream.next() != nullptr) continue;
    EXPECT_TRUE(stream.complete());
    EXPECT_EQ(stream.damage_count(), 0u);
  }
}

TEST_F(McapPeer, WritesMessagesOfRos2ThatWeRead) {
  const fs::path file = folder_ / "ros2.mcap";
  const Ran wrote = run_script("ros2.js", "write '" + file.string() + "'");
  ASSERT_EQ(wrote.status, 0) << wrote.output;
  const Ran compared = run(MIMESIS_BIN_DIR "/mimesis log cat --bytes hex '" + file.string() +
                           "' | node " MIMESIS_SOURCE_DIR "/tests/peer/ros2.js compare");
  EXPECT_EQ(compared.output, "144 of 144 equal");
}

/// Runs of ours as bags of ROS 2: every definition is that of ROS, every message is read by it.
TEST_F(McapPeer, ReadsOurRunsAsBagsOfRos2) {
  const auto bag = [&](const std::string& node) {
    const fs::path folder = folder_ / node;
    const std::string log = MIMESIS_SOURCE_DIR "/tests/replay/logs/" + node + ".mcap";
    const Ran made = run(MIMESIS_BIN_DIR "/mimesis log convert '" + log + "' '" + folder.string() +
                         "' --rosbag2 2>/dev/null");
    EXPECT_EQ(made.status, 0) << node;
    const Ran seen = run_script("ros2.js", "read '" + (folder / (node + "_0.mcap")).string() + "'");
    EXPECT_EQ(seen.status, 0) << seen.output;
    auto topics = nlohmann::json::parse(seen.output, nullptr, false);
    for (const auto& [topic, t] : topics.items()) {
      EXPECT_EQ(t["encoding"], "cdr") << topic;
      EXPECT_EQ(t["differ"], nlohmann::json::array()) << topic << ' ' << t["type"];
    }
    return topics;
  };
  const auto figure = bag("synthesizer")["/synthesizer/figures"];
  EXPECT_EQ(figure["type"], "visualization_msgs/msg/MarkerArray");
  EXPECT_EQ(figure["messages"], 150);
  const auto& markers = figure["last"]["markers"];
  ASSERT_GT(markers.size(), 20u);
  EXPECT_EQ(markers[0]["header"]["frame_id"], "world");
  EXPECT_EQ(markers[0]["ns"], "figures");
  EXPECT_NEAR(markers[0]["pose"]["orientation"]["w"].get<double>(), 0.0, 1.0);
  const auto picture = bag("camera")["/camera/image"];
  EXPECT_EQ(picture["type"], "sensor_msgs/msg/Image");
  EXPECT_EQ(picture["last"]["encoding"], "bgr8");
  EXPECT_EQ(picture["last"]["data"]["length"], 160 * 120 * 3);
  const auto walk = bag("walker");
  EXPECT_EQ(walk["/tf"]["type"], "tf2_msgs/msg/TFMessage");
  EXPECT_GT(walk["/tf"]["last"]["transforms"].size(), 20u);
  const auto arm = bag("bridge")["/bridge/joints"];
  EXPECT_EQ(arm["type"], "sensor_msgs/msg/JointState");
  EXPECT_EQ(arm["last"]["name"].size(), 7u);
  EXPECT_EQ(arm["last"]["position"]["length"], 7);
}

}  // namespace
}  // namespace mimesis::peer
