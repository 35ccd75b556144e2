#include "common/log/writer.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <filesystem>

#include "common/log/codec.h"
#include "common/log/stream_reader.h"
#include "common/log/summary.h"
#include "common/log/test/sample_log.h"

namespace mimesis::log {
namespace {

TEST(Crc32, IsTheOneOfZlibAndJoins) {
  EXPECT_EQ(crc32(0, "123456789"), 0xCBF43926u);  // the check value of the published catalogue
  EXPECT_EQ(crc32_join(crc32(0, "1234"), crc32(0, "56789"), 5), 0xCBF43926u);
}

TEST(Crc32, IsZlibsForAllSizesAndPlaces) {
  std::string bytes;
  for (std::uint32_t i = 0; bytes.size() < 20'000; ++i) bytes += sample_message(i).data;
  const auto zlibs = [](std::uint32_t crc, std::string_view b) {
    return ::crc32_z(crc, reinterpret_cast<const Bytef*>(b.data()), b.size());
  };
  for (std::size_t size = 0; size < 9000; size += size < 300 ? 1 : 37) {
    for (const std::size_t at : {0u, 1u, 33u, 63u}) {
      const std::string_view part = std::string_view(bytes).substr(at, size);
      ASSERT_EQ(crc32(0, part), zlibs(0, part)) << size << " at " << at;
      ASSERT_EQ(crc32(0x12345678, part), zlibs(0x12345678, part)) << size << " at " << at;
    }
  }
}

class RoundTrip : public ::testing::TestWithParam<std::tuple<Compression, std::size_t>> {};

TEST_P(RoundTrip, DeliversWhatWasWritten) {
  const auto [compression, chunk_size] = GetParam();
  constexpr std::uint32_t kWritten = 2000;
  const std::string file = sample_log(kWritten, compression, chunk_size);
  const MemorySource source(file);
  StreamReader reader(source);
  std::uint32_t messages = 0, attachments = 0, metadata = 0;
  while (const Record* record = reader.next()) {
    if (const auto* m = std::get_if<Message>(record)) {
      ASSERT_EQ(sample(*m), sample_message(messages));
      ++messages;
    } else if (const auto* a = std::get_if<Attachment>(record)) {
      ++attachments;
      EXPECT_EQ(a->name, "launch.yaml");
      EXPECT_EQ(a->data, "nodes: {}");
      EXPECT_NE(a->crc, 0u);
    } else if (const auto* losses = std::get_if<Metadata>(record)) {
      ++metadata;
      EXPECT_EQ(losses->metadata.at("a/out"), "0");
    } else if (const auto* d = std::get_if<DataEnd>(record)) {
      EXPECT_NE(d->data_section_crc, 0u);
    }
  }
  EXPECT_EQ(messages, kWritten);
  EXPECT_EQ(attachments, 1u);
  EXPECT_EQ(metadata, 1u);
  EXPECT_TRUE(reader.complete());
  EXPECT_EQ(reader.damage_count(), 0u);
  EXPECT_EQ(reader.schemas().at(1).data, "descriptors of A");
  EXPECT_EQ(reader.channels().at(1).metadata.at("node"), "a");
}

INSTANTIATE_TEST_SUITE_P(Codecs, RoundTrip,
                         ::testing::Combine(::testing::Values(Compression::none, Compression::lz4,
                                                              Compression::zstd),
                                            ::testing::Values(0, 1, 4096, 1 << 20)));

TEST(Writer, CompressesAndStatesTheSizes) {
  const std::string plain = sample_log(2000, Compression::none, 1 << 16);
  for (const auto codec : {Compression::lz4, Compression::zstd}) {
    const std::string file = sample_log(2000, codec, 1 << 16);
    EXPECT_LT(file.size(), plain.size() * 95 / 100);
    const MemorySource source(file);
    const auto summary = summarize(source);
    ASSERT_TRUE(summary);
    for (const Segment& s : summary->segments) {
      EXPECT_EQ(s.index.compression, wire_name(codec));
      EXPECT_LT(s.index.compressed_size, s.index.uncompressed_size);
    }
  }
}

TEST(Writer, AfterFlushEverythingIsReadableWithoutAnEnd) {
  std::string out;
  MemorySink sink(out);
  Writer writer(sink, {});
  add_sample_channels(writer);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const SampleMessage m = sample_message(i);
    ASSERT_TRUE(writer.write({m.channel_id, m.sequence, m.log_time, m.publish_time, m.data}));
  }
  EXPECT_GT(writer.open_chunk_bytes(), 0u);
  ASSERT_TRUE(writer.flush());
  EXPECT_EQ(writer.open_chunk_bytes(), 0u);
  ASSERT_TRUE(writer.sync());      // flush alone does not wait
  const MemorySource source(out);  // the file as after kill -9
  const auto summary = summarize(source);
  ASSERT_TRUE(summary);
  EXPECT_FALSE(summary->from_file);
  EXPECT_EQ(summary->statistics.message_count, 100u);
  ASSERT_EQ(summary->damages.size(), 1u);
  EXPECT_EQ(summary->damages[0].offset, out.size());
  EXPECT_EQ(summary->damages[0].what, "the file ends here, without a footer");
}

TEST(Writer, TheKernelsErrorNamesTheFile) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "not here: no /dev/full";
  auto sink = create_file("/dev/full");
  ASSERT_TRUE(sink);
  Writer writer(**sink, {});
  const Result done = writer.finish();
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().reason, "cannot write '/dev/full': No space left on device");
  EXPECT_FALSE(create_file("/no/such/folder/x.mcap"));
}

TEST(Writer, AFileIsItsOwnersAndOfOneWriter) {
  const std::string path =
      std::filesystem::temp_directory_path() / ("mimesis-log-one-" + std::to_string(getpid()));
  std::filesystem::remove(path);
  auto first = create_file(path);
  ASSERT_TRUE(first);
  ASSERT_TRUE((*first)->write("first"));
  ASSERT_TRUE((*first)->flush());
  using std::filesystem::perms;
  EXPECT_EQ(std::filesystem::status(path).permissions(), perms::owner_read | perms::owner_write);
  const auto second = create_file(path);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().reason, "cannot create '" + path +
                                       "': another process is writing it, expected a file of its "
                                       "own");
  EXPECT_EQ(std::filesystem::file_size(path), 5u);
  ASSERT_TRUE((*first)->close());
  EXPECT_TRUE(create_file(path));
  EXPECT_EQ(std::filesystem::file_size(path), 0u);
  std::filesystem::remove(path);
}

TEST(Writer, FilesAreWhatMemoryWouldBe) {
  const auto path =
      std::filesystem::temp_directory_path() / ("mimesis-log-" + std::to_string(getpid()));
  {
    auto sink = create_file(path.string());
    ASSERT_TRUE(sink);
    Writer writer(**sink, {.compression = Compression::none, .chunk_size = 200'000});
    ASSERT_TRUE(writer.add_channel(0, "t", "", {}));
    for (std::uint32_t i = 0; i < 5000; ++i) {
      const SampleMessage m = sample_message(i);
      ASSERT_TRUE(writer.write({1, m.sequence, m.log_time, m.publish_time, m.data}));
    }
    ASSERT_TRUE(writer.sync());
    EXPECT_EQ(writer.bytes_written(), std::filesystem::file_size(path));
    ASSERT_TRUE(writer.finish());
    EXPECT_EQ(writer.bytes_written(), std::filesystem::file_size(path));
  }
  auto source = open_file(path.string());
  ASSERT_TRUE(source);
  StreamReader reader(**source);
  std::uint32_t i = 0;
  while (const Record* record = reader.next()) {
    if (const auto* m = std::get_if<Message>(record)) {
      ASSERT_EQ(m->data, sample_message(i++).data);
    }
  }
  EXPECT_EQ(i, 5000u);
  EXPECT_EQ(reader.damage_count(), 0u);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace mimesis::log
