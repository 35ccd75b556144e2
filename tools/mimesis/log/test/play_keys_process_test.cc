// `mimesis log play` on a terminal: keys, the progress line, and the state of the terminal
// afterwards.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <csignal>
#include <filesystem>

#include "common/log/writer.h"
#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "common/testing/terminal.h"
#include "proto/runtime.pb.h"

namespace mimesis::tool {
namespace {

using testing::TestGraph;
using namespace std::chrono_literals;
namespace fs = std::filesystem;

/// The player on a terminal of its own.
struct PlayerOnTerminal : testing::OnTerminal {
  PlayerOnTerminal(const std::string& file, std::vector<std::string> options)
      : OnTerminal([&] {
          options.insert(options.begin(), {MIMESIS_BIN_DIR "/mimesis", "log", "play", file});
          return options;
        }()) {}
};

class LogPlayKeys : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("MIMESIS_GRAPH", graph_.name().c_str(), 1);
    file_ = (fs::temp_directory_path() / ("mimesis-keys-" + graph_.name() + ".mcap")).string();
    const auto sink = log::create_file(file_);
    log::Writer writer(**sink, {});
    const auto& type = *v1::Publication::descriptor();
    const auto schema =
        *writer.add_schema(type.full_name(), "protobuf", runtime::descriptor_set(type));
    const auto channel = *writer.add_channel(schema, "a/out", "protobuf", {});
    for (std::uint32_t i = 0; i < 10; ++i) {
      ASSERT_TRUE(writer.write({channel, i + 1, 100'000'000'000ULL * i, 0, ""}));
    }
    ASSERT_TRUE(writer.finish());
  }
  void TearDown() override { fs::remove(file_); }

  TestGraph graph_;
  std::string file_;
};

TEST_F(LogPlayKeys, DoWhatTheHelpSays) {
  PlayerOnTerminal player(file_, {"--paused"});
  EXPECT_TRUE(player.shows("0.0 / 900.0 s"));
  EXPECT_TRUE(player.shows("PAUSED\r"));  // the player waits only for keys
  EXPECT_FALSE(player.cooked());
  player.type("ss");
  EXPECT_TRUE(player.shows("100.0 / 900.0 s"));
  player.type("\x1b[C");  // right while paused
  EXPECT_TRUE(player.shows("200.0 / 900.0 s"));
  player.type("\x1b[D");
  EXPECT_TRUE(player.shows("195.0 / 900.0 s"));
  player.type("\x1b[A\x1b[A");
  EXPECT_TRUE(player.shows("x1.21"));
  player.type("\x1b[B");
  EXPECT_TRUE(player.shows("x1.1 "));
  player.type(" ");
  EXPECT_TRUE(player.shows("late 0.00 ms\r"));  // runs
  player.type("\x1b[C");
  EXPECT_TRUE(player.shows("\x1b[K20"));
  player.type("q");
  EXPECT_TRUE(player.shows("messages played"));
  EXPECT_EQ(player.wait(), 0);
  EXPECT_TRUE(player.cooked());
}

TEST_F(LogPlayKeys, TheTerminalIsRestoredHoweverThePlayerEnds) {
  for (const auto& [signal, code] : {std::pair{SIGINT, 130},
                                     {SIGTERM, 130},
                                     {SIGHUP, 128 + SIGHUP},
                                     {SIGQUIT, 128 + SIGQUIT},
                                     {SIGSEGV, 128 + SIGSEGV},
                                     {SIGABRT, 128 + SIGABRT}}) {
    PlayerOnTerminal player(file_, {"--paused"});
    EXPECT_TRUE(player.shows("PAUSED"));
    EXPECT_FALSE(player.cooked());
    player.signal(signal);
    EXPECT_EQ(player.wait(), code);
    EXPECT_TRUE(player.cooked()) << signal;
  }
}

TEST_F(LogPlayKeys, ASuspendedPlayerLeavesTheTerminalToOthers) {
  PlayerOnTerminal player(file_, {"--paused"});
  EXPECT_TRUE(player.shows("PAUSED"));
  player.signal(SIGTSTP);
  ASSERT_TRUE(player.stopped());
  EXPECT_TRUE(player.cooked());
  player.signal(SIGCONT);
  player.type("s");
  EXPECT_TRUE(player.shows("PAUSED"));
  player.type("q");
  EXPECT_EQ(player.wait(), 0);
  EXPECT_TRUE(player.cooked());
}

TEST_F(LogPlayKeys, NoKeysLeavesItAlone) {
  PlayerOnTerminal player(file_, {"--paused", "--no-keys"});
  EXPECT_TRUE(player.shows("PAUSED"));
  EXPECT_TRUE(player.cooked());
  player.signal(SIGTERM);
  EXPECT_EQ(player.wait(), 130);
}

}  // namespace
}  // namespace mimesis::tool
