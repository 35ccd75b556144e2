#include "common/log/test/sample_log.h"

#include <gtest/gtest.h>

namespace mimesis::log {

SampleMessage sample_message(std::uint32_t i) {
  std::uint64_t random = i;
  std::string data(40 + i % 50, 'a');
  for (std::size_t k = 0; k < data.size(); k += 2) {
    random = random * 6364136223846793005u + 1442695040888963407u;  // Knuth's generator
    data[k] = static_cast<char>(random >> 56);
  }
  const std::uint64_t tick = i - (i % 3 == 2 ? 1 : 0);
  return {static_cast<std::uint16_t>(1 + i % 2), i / 2 + 1, 1000 + 10 * tick, 900 + 10 * i,
          std::move(data)};
}

void add_sample_channels(Writer& writer) {
  ASSERT_EQ(writer.add_schema("test.A", "protobuf", "descriptors of A").value(), 1);
  ASSERT_EQ(writer.add_schema("test.B", "protobuf", "descriptors of B").value(), 2);
  ASSERT_EQ(writer.add_channel(1, "a/out", "protobuf", {{"node", "a"}}).value(), 1);
  ASSERT_EQ(writer.add_channel(2, "b/out", "protobuf", {}).value(), 2);
}

std::string sample_log(std::uint32_t count, Compression compression, std::size_t chunk_size) {
  std::string out;
  MemorySink sink(out);
  Writer writer(sink, {.compression = compression, .chunk_size = chunk_size});
  add_sample_channels(writer);
  for (std::uint32_t i = 0; i < count; ++i) {
    const SampleMessage m = sample_message(i);
    EXPECT_TRUE(writer.write({m.channel_id, m.sequence, m.log_time, m.publish_time, m.data}));
    if (i == count / 2) {
      Attachment attachment;
      attachment.name = "launch.yaml";
      attachment.data = "nodes: {}";
      EXPECT_TRUE(writer.attach(attachment));
    }
  }
  EXPECT_TRUE(writer.add_metadata({"losses", {{"a/out", "0"}}}));
  EXPECT_TRUE(writer.finish());
  return out;
}

}  // namespace mimesis::log
