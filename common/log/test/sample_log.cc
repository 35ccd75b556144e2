#include "common/log/test/sample_log.h"

#include <gtest/gtest.h>

#include "common/log/indexed_reader.h"

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

namespace {

void add(const Message& message, Outcome& outcome) {
  const std::uint32_t i = 2 * (message.sequence - 1) + (message.channel_id - 1u);
  outcome.messages.push_back(i);
  outcome.altered += sample(message) != sample_message(i);
}

std::string text(const Attachment& a) {
  return a.name + "|" + a.media_type + "|" + std::to_string(a.log_time) + "|" +
         std::to_string(a.create_time) + "|" + std::string(a.data);
}

std::string text(const Metadata& m) {
  std::string all = m.name;
  for (const auto& [key, value] : m.metadata) all += "|" + key + "=" + value;
  return all;
}

}  // namespace

Outcome read_streamed(const std::string& file, const ReaderLimits& limits) {
  const MemorySource source(file);
  StreamReader reader(source, limits);
  Outcome outcome;
  while (const Record* record = reader.next()) {
    if (const auto* m = std::get_if<Message>(record)) add(*m, outcome);
    if (const auto* a = std::get_if<Attachment>(record)) outcome.attachments.push_back(text(*a));
    if (const auto* m = std::get_if<Metadata>(record)) outcome.metadata.push_back(text(*m));
  }
  outcome.damages = reader.damages();
  return outcome;
}

Outcome read_indexed(const std::string& file) {
  const MemorySource source(file);
  Outcome outcome;
  const auto summary = summarize(source);
  if (!summary) {
    outcome.damages.push_back({0, summary.error().reason});
    return outcome;
  }
  outcome.damages = summary->damages;
  IndexedReader reader(source, *summary);
  while (const Message* m = reader.next()) add(*m, outcome);
  outcome.damages.insert(outcome.damages.end(), reader.damages().begin(), reader.damages().end());
  for (const AttachmentIndex& index : summary->attachments) {
    std::string data;
    if (const auto a = read_attachment(source, index, data)) {
      outcome.attachments.push_back(text(*a));
    } else {
      outcome.damages.push_back({index.offset, a.error().reason});
    }
  }
  return outcome;
}

}  // namespace mimesis::log
