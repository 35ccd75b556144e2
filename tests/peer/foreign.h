#pragma once
// Functions of the tests against programs of npm.
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/log/indexed_reader.h"

namespace mimesis::peer {

namespace fs = std::filesystem;

struct Ran {
  int status = -1;
  std::string output;  ///< without the last newline
};

inline Ran run(const std::string& command) {
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

/// Runs a script of this folder.
inline Ran run_script(const std::string& script, const std::string& arguments) {
  return run("node " MIMESIS_SOURCE_DIR "/tests/peer/" + script + " " + arguments);
}

/// Messages of a log: how many by topic, and a sum over all payloads in the order of the file.
struct Contents {
  std::map<std::string, int> counts;
  std::uint32_t digest = 2166136261u;  ///< FNV-1a
  bool operator==(const Contents&) const = default;
};

inline Contents contents_of(log::StreamReader& reader) {
  Contents contents;
  while (const log::Record* record = reader.next()) {
    const auto* message = std::get_if<log::Message>(record);
    if (message == nullptr) continue;
    ++contents.counts[reader.channels().at(message->channel_id).topic];
    for (const char c : message->data) {
      contents.digest = (contents.digest ^ static_cast<unsigned char>(c)) * 16777619u;
    }
  }
  return contents;
}

/// A folder of its own for each test; skipped where there are no node modules.
class Foreign : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string install = MIMESIS_SOURCE_DIR "/tests/peer/install " MIMESIS_BIN_DIR "/..";
    const Ran modules = run(install);
    if (modules.status != 0) GTEST_SKIP() << "no foreign programs: " << modules.output;
    setenv("NODE_PATH", modules.output.c_str(), 1);
    std::string name = (fs::temp_directory_path() / "mimesis-peer-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  /// Contents of each file according to the reference reader.
  static nlohmann::json read_with_peer(const std::vector<fs::path>& files) {
    std::string arguments;
    for (const fs::path& file : files) arguments += " '" + file.string() + "'";
    const Ran ran = run_script("read_mcap.js", arguments);
    EXPECT_EQ(ran.status, 0);
    return nlohmann::json::parse(ran.output, nullptr, false);
  }
  fs::path folder_;
};

inline Contents contents_of(const nlohmann::json& peer) {
  return {peer.at("streamed").get<std::map<std::string, int>>(), peer.at("digest")};
}

}  // namespace mimesis::peer
