// What libFuzzer has found (corpus.txt: a reader's name and bytes a line), read again in any build.
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <vector>

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

/// The first byte chooses the reader, as in codec_fuzz.cc.
const std::map<std::string, std::uint8_t> kReaders{{"master", 0}, {"client", 1},    {"drive", 2},
                                                   {"hand", 3},   {"powercube", 4}, {"module", 5},
                                                   {"slcan", 6},  {"setup", 7},     {"eds", 8}};

TEST(Corpus, IsReadWithoutAFinding) {
  std::ifstream file(MIMESIS_SOURCE_DIR "/hw/cia402/fuzz/corpus.txt");
  std::map<std::string, int> counts;
  std::string reader, hex;
  while (file >> reader >> hex) {
    std::vector<std::uint8_t> bytes{kReaders.at(reader)};
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
      bytes.push_back(static_cast<std::uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
    ++counts[reader];
  }
  EXPECT_EQ(counts.size(), kReaders.size()) << "a reader without inputs";
}

}  // namespace
