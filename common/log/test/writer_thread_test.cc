// The thread behind a Writer: same bytes, no failure lost, the caller does not wait for the disk.
#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>

#include "common/log/summary.h"
#include "common/log/test/sample_log.h"

namespace mimesis::log {
namespace {

/// Has room for this number of bytes.
class SmallDisk final : public Sink {
 public:
  explicit SmallDisk(std::size_t room) : room_(room) {}
  Result write(std::string_view bytes) override {
    if (bytes.size() > room_) return tl::unexpected(Status{"no space left"});
    room_ -= bytes.size();
    return {};
  }
  Result flush() override { return {}; }
  Result close() override { return {}; }

 private:
  std::size_t room_;
};

TEST(WriterThread, AFullDiskIsReportedByEveryCallFromThenOn) {
  for (const bool background : {false, true}) {
    for (const std::size_t room : {0, 10, 3000, 20'000}) {
      SmallDisk disk(room);
      Writer writer(
          disk, {.compression = Compression::none, .chunk_size = 1000, .background = background});
      const std::string data(500, 'x');
      Result done;
      if (auto id = writer.add_channel(0, "t", "", {}); !id) done = tl::unexpected(id.error());
      // The thread in the background is at most a few chunks behind.
      for (int i = 0; i < 100 && done; ++i) done = writer.write({1, 0, 0, 0, data});
      ASSERT_FALSE(done) << room;
      EXPECT_EQ(done.error().reason, "no space left") << room;
      EXPECT_FALSE(writer.write({1, 0, 0, 0, data}));
      EXPECT_FALSE(writer.flush());
      EXPECT_FALSE(writer.sync());
      EXPECT_FALSE(writer.add_metadata({"counts", {}}));
      EXPECT_FALSE(writer.finish());
    }
  }
}

TEST(WriterThread, AFailureOfTheLastChunkIsReportedByFinish) {
  SmallDisk disk(100);  // room for the header alone
  Writer writer(disk, {});
  ASSERT_TRUE(writer.add_channel(0, "t", "", {}));
  for (std::uint32_t i = 0; i < 10; ++i)
    ASSERT_TRUE(writer.write({1, 0, 0, 0, std::string(i, 'x')}));
  ASSERT_TRUE(writer.flush());  // on its way, not yet met
  const Result done = writer.finish();
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().reason, "no space left");
}

/// Opens its gate for this number of calls.
class SlowSink final : public Sink {
 public:
  explicit SlowSink(std::string& bytes) : bytes_(bytes) {}
  void open(int calls) {
    const std::scoped_lock lock(mutex_);
    calls_ += calls;
    changed_.notify_all();
  }
  Result write(std::string_view bytes) override {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return calls_ > 0; });
    --calls_;
    bytes_.append(bytes);
    return {};
  }
  Result flush() override { return {}; }
  Result sync() override {
    ++syncs;
    return {};
  }
  Result close() override { return {}; }

  int syncs = 0;

 private:
  std::string& bytes_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int calls_ = 0;
};

TEST(WriterThread, TheCallerGoesOnWhileTheDiskIsSlow) {
  std::string out;
  SlowSink sink(out);
  sink.open(1);  // the file's head
  Writer writer(sink, {.compression = Compression::none});
  ASSERT_TRUE(writer.add_channel(0, "t", "", {}));
  const std::uint64_t head = writer.bytes_written();
  for (int i = 0; i < 3; ++i) {  // three chunks find room
    ASSERT_TRUE(writer.write({1, 0, 0, 0, "x"}));
    ASSERT_TRUE(writer.flush());
  }
  EXPECT_EQ(writer.open_chunk_bytes(), 0u);
  EXPECT_GE(writer.bytes_written(), head);
  sink.open(1000);
  ASSERT_TRUE(writer.sync());
  EXPECT_EQ(sink.syncs, 1);
  EXPECT_EQ(out.size(), writer.bytes_written());
  ASSERT_TRUE(writer.finish());
  const MemorySource source(out);
  EXPECT_EQ(summarize(source)->statistics.message_count, 3u);
}

/// Definitions, flushes and attachments in irregular places.
std::string mixed_log(Compression compression, std::size_t chunk_size, bool background) {
  std::string out;
  MemorySink sink(out);
  Writer writer(sink,
                {.compression = compression, .chunk_size = chunk_size, .background = background});
  add_sample_channels(writer);
  for (std::uint32_t i = 0; i < 3000; ++i) {
    const SampleMessage m = sample_message(i);
    EXPECT_TRUE(writer.write({m.channel_id, m.sequence, m.log_time, m.publish_time, m.data}));
    bool done = true;
    if (i % 97 == 0) done &= writer.flush().has_value();
    if (i % 701 == 0) done &= writer.sync().has_value();
    if (i % 500 == 3) done &= writer.add_channel(1, "c/" + std::to_string(i), "", {}).has_value();
    if (i % 1100 == 7) done &= writer.add_metadata({"m", {{"i", std::to_string(i)}}}).has_value();
    if (i % 900 == 5) {
      Attachment attachment;
      attachment.data = m.data;
      done &= writer.attach(attachment).has_value();
    }
    EXPECT_TRUE(done);
  }
  EXPECT_TRUE(writer.finish());
  EXPECT_EQ(writer.bytes_written(), out.size());
  return out;
}

TEST(WriterThread, InTheBackgroundItWritesTheSameBytes) {
  for (const auto codec : {Compression::none, Compression::lz4, Compression::zstd}) {
    for (const std::size_t chunk_size : {0, 1, 3000, 1 << 20}) {
      EXPECT_EQ(mixed_log(codec, chunk_size, true), mixed_log(codec, chunk_size, false));
    }
  }
}

TEST(WriterThread, WithoutFinishClosedChunksAreWrittenAndTheOpenOneIsLost) {
  std::string out;
  MemorySink sink(out);
  {
    Writer writer(sink, {});
    ASSERT_TRUE(writer.add_channel(0, "t", "", {}));
    for (int i = 0; i < 5; ++i) {
      ASSERT_TRUE(writer.write({1, 0, 0, 0, "x"}));
      ASSERT_TRUE(writer.flush());
    }
    ASSERT_TRUE(writer.write({1, 0, 0, 0, "lost"}));
  }
  const MemorySource source(out);
  EXPECT_EQ(scan(source)->statistics.message_count, 5u);
}

}  // namespace
}  // namespace mimesis::log
