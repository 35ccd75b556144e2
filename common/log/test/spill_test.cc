#include "common/log/spill.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/log/summary.h"
#include "common/log/writer.h"

namespace mimesis::log {
namespace {

namespace fs = std::filesystem;

std::string read_back(const Spill& spill) {
  std::string all;
  EXPECT_TRUE(spill.read([&all](std::string_view piece) {
    all.append(piece);
    return Result{};
  }));
  return all;
}

std::string fill(Spill& spill, int count) {
  std::string expected;
  for (int i = 0; i < count; ++i) {
    const std::string entry = "entry " + std::to_string(7 * i) + ";";
    spill.append(entry);
    expected += entry;
  }
  return expected;
}

TEST(Spill, KeepsTheOrderOnDiskAndInMemory) {
  Spill spill(fs::temp_directory_path(), 1000);
  const std::string expected = fill(spill, 60'000);  // several pieces when read back
  EXPECT_LT(spill.in_memory(), 1000U);
  EXPECT_EQ(spill.size(), expected.size());
  EXPECT_TRUE(read_back(spill) == expected);
  EXPECT_TRUE(read_back(spill) == expected) << "once more";
}

TEST(Spill, StaysInMemoryWhereNoFileCanBe) {
  for (const char* folder : {"", "/proc/self", "/there/is/no/such/folder"}) {
    Spill spill(folder, 100);
    const std::string expected = fill(spill, 500);
    EXPECT_EQ(spill.in_memory(), expected.size()) << folder;
    EXPECT_TRUE(read_back(spill) == expected) << folder;
  }
}

TEST(Spill, StopsWhenAPieceIsNotTaken) {
  Spill spill(fs::temp_directory_path(), 1000);
  fill(spill, 60'000);
  int pieces = 0;
  const Result result = spill.read([&pieces](std::string_view) -> Result {
    ++pieces;
    return tl::unexpected(Status{"full"});
  });
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().reason, "full");
  EXPECT_EQ(pieces, 1);
}

/// A chunk for each message of forty channels in turn: 1.4 MB of chunk indexes.
void write_many_chunks(Sink& sink) {
  Writer writer(sink, {.compression = Compression::none, .chunk_size = 1});
  std::vector<std::uint16_t> channels;
  for (int i = 0; i < 40; ++i) {
    channels.push_back(*writer.add_channel(0, "topic/" + std::to_string(i), "", {}));
  }
  for (std::uint32_t i = 0; i < 14'000; ++i) {
    ASSERT_TRUE(writer.write({channels[i % channels.size()], i + 1, i, i, "x"}));
  }
  ASSERT_TRUE(writer.finish());
}

TEST(Spill, AFileIsTheSameAsInMemory) {
  std::string memory;
  MemorySink sink(memory);
  write_many_chunks(sink);

  const fs::path path = fs::temp_directory_path() / ("spill-" + std::to_string(getpid()));
  auto file = create_file(path.string());
  ASSERT_TRUE(file);
  EXPECT_EQ((*file)->folder(), fs::temp_directory_path().string());
  write_many_chunks(**file);
  std::ostringstream content;
  content << std::ifstream(path, std::ios::binary).rdbuf();
  fs::remove(path);
  EXPECT_TRUE(content.str() == memory);

  const MemorySource source(memory);
  const auto summary = summarize(source);
  ASSERT_TRUE(summary);
  EXPECT_TRUE(summary->from_file);
  EXPECT_EQ(summary->segments.size(), 14'000U);
}

}  // namespace
}  // namespace mimesis::log
