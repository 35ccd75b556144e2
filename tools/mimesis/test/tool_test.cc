#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/error.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/log_folder.h"
#include "tools/mimesis/rate_window.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {
using namespace std::chrono_literals;

TEST(TextTable, AlignsByCharactersNotBytes) {
  TextTable table({"NAME", "X"});
  table.row({"größe", "1"});
  table.row({"ab", "22"});
  std::ostringstream out;
  table.print(out, false);
  EXPECT_EQ(out.str(), "NAME   X\ngröße  1\nab     22\n");
}

TEST(TextTable, WordsOfOthersCannotCommandTheTerminal) {
  EXPECT_EQ(printable("größe 漢 \U0001F600 a\\b"), "größe 漢 \U0001F600 a\\b");
  EXPECT_EQ(printable("\033[2J\n\x7f\u009b"), "\\u001b[2J\\u000a\\u007f\\u009b");
  EXPECT_EQ(printable("\x9b\xe6\xbc"), "\\u009b\\u00e6\\u00bc");
  EXPECT_EQ(printable("a\n\tb", "\n"), "a\n\\u0009b");
  TextTable table({"TOPIC"});
  table.row({"\033]0;x\007"});
  std::ostringstream out;
  table.print(out, false);
  EXPECT_EQ(out.str(), "TOPIC\n\\u001b]0;x\\u0007\n");
}

TEST(RateWindow, CountsWhatItDidNotSee) {
  RateWindow window(10);
  const RateWindow::Time t0{};
  EXPECT_FALSE(window.rate());
  window.add(t0, 1);
  window.add(t0 + 10ms, 2);
  window.add(t0 + 40ms, 5);  // 3 and 4 did not come through
  const auto rate = window.rate();
  ASSERT_TRUE(rate);
  EXPECT_NEAR(rate->hz, 100.0, 1e-9);
  EXPECT_EQ(rate->messages, 4U);
  EXPECT_NEAR(rate->max_s, 0.010, 1e-12);
}

TEST(RateWindow, ForgetsOldOnesAndAPublisherThatWasStartedAgain) {
  RateWindow window(3);
  const RateWindow::Time t0{};
  for (int i = 0; i < 10; ++i) window.add(t0 + i * 1s, static_cast<std::uint64_t>(i + 1));
  for (int i = 0; i < 3; ++i) window.add(t0 + 10s + i * 100ms, static_cast<std::uint64_t>(i + 1));
  EXPECT_NEAR(window.rate()->hz, 10.0, 1e-9);
}

int usage_of(std::vector<std::string> words, std::string& err) {
  CLI::App program("p", "mimesis");
  program.require_subcommand(1);
  CLI::App* topic = program.add_subcommand("topic", "t");
  topic->require_subcommand(1);
  topic->add_subcommand("echo", "e")->add_flag("--once");
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  int code = 0;
  try {
    std::reverse(words.begin(), words.end());
    program.parse(words);
  } catch (const CLI::ParseError& e) {
    code = report_usage(program, e);
  }
  testing::internal::GetCapturedStdout();
  err = testing::internal::GetCapturedStderr();
  return code;
}

TEST(Usage, SuggestsOnTheLevelOfTheMistake) {
  std::string err;
  EXPECT_EQ(usage_of({"tpoic"}, err), 2);
  EXPECT_EQ(err, "mimesis: unknown verb 'tpoic', did you mean 'topic'?\nSee: mimesis --help\n");
  EXPECT_EQ(usage_of({"topic", "ecko"}, err), 2);
  EXPECT_EQ(
      err, "mimesis topic: unknown verb 'ecko', did you mean 'echo'?\nSee: mimesis topic --help\n");
  EXPECT_EQ(usage_of({"topic", "echo", "--onec"}, err), 2);
  EXPECT_EQ(err,
            "mimesis topic echo: unknown option '--onec', did you mean '--once'?\n"
            "See: mimesis topic echo --help\n");
  EXPECT_EQ(usage_of({"topic"}, err), 2);
  EXPECT_EQ(err, "mimesis topic: expected a verb: echo\nSee: mimesis topic --help\n");
  EXPECT_EQ(usage_of({"--once", "topic", "echo"}, err), 2);
  EXPECT_EQ(err,
            "mimesis topic echo: '--once' belongs behind the verb: mimesis topic echo --once ...\n"
            "See: mimesis topic echo --help\n");
  EXPECT_EQ(usage_of({"topic", "--help"}, err), 0);
  EXPECT_EQ(usage_of({"topic", "echo", "--once"}, err), 0);
  EXPECT_EQ(err, "");
}

TEST(LogFolder, OldestRunsGoButNotThoseThatRunOrWereNamed) {
  const std::string state = ::testing::TempDir() + "log_folder_test";
  std::filesystem::remove_all(state);
  setenv("XDG_STATE_HOME", state.c_str(), 1);
  const auto add = [](const std::string& name) {
    std::filesystem::create_directories(log_root() / name);
    std::ofstream(log_root() / name / "a.log") << std::string(100, 'x');
  };
  const std::vector<std::string> names{"20260101-000000-a-1", "20260102-000000-a-2",
                                       "20260103-named", "20260104-000000-a-4",
                                       "20260105-000000-a-5"};
  for (const std::string& name : names) add(name);
  const RunLock second(log_root() / names[1]);
  EXPECT_THROW(RunLock(log_root() / names[1]), ConfigError);

  const std::vector<RunFolder> runs = run_folders();
  ASSERT_EQ(runs.size(), 5U);
  EXPECT_EQ(runs[0].bytes, 100U);
  EXPECT_TRUE(runs[1].running && !runs[0].running);
  EXPECT_TRUE(runs[2].kept && !runs[3].kept);
  const auto gone = [&](const LogLimit& limit) {
    std::vector<std::string> list;
    for (const RunFolder& run : beyond(runs, limit)) list.push_back(run.name);
    return list;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(gone({}), Names{});
  EXPECT_EQ(gone({.bytes = 500}), Names{});
  EXPECT_EQ(gone({.bytes = 499}), (Names{names[0]}));
  EXPECT_EQ(gone({.runs = 3}), (Names{names[0], names[3]}));
  EXPECT_EQ(gone({.runs = 0}), (Names{names[0], names[3], names[4]}));
  EXPECT_EQ(remove_run(runs[0]), "");
  EXPECT_FALSE(std::filesystem::exists(log_root() / names[0]));
  std::filesystem::remove_all(state);
}

v1::NodeInfo node(const std::string& name, const std::vector<std::string>& out,
                  const std::vector<std::string>& in, const std::string& obeys = "") {
  v1::NodeInfo info;
  info.set_name(name);
  for (const std::string& topic : out) info.add_outputs()->set_topic(topic);
  for (const std::string& topic : in) {
    v1::TopicInfo& input = *info.add_inputs();
    input.set_topic(topic);
    input.set_one_author(!obeys.empty());
    if (obeys != "first") input.set_obeys(obeys);
  }
  return info;
}

/// What is said of publishing `topic`; empty: nothing.
std::string said(const std::string& topic, const std::vector<v1::NodeInfo>& nodes,
                 std::set<std::string, std::less<>> into_live = {}, const char* self = "player") {
  try {
    demand_leave({.verb = "play", .self = self, .topics = {topic}, .into_live = into_live}, nodes);
  } catch (const ConfigError& e) {
    return e.what();
  }
  return {};
}

TEST(LiveTopics, WhatANodePublishesIsItsOwn) {
  const std::vector nodes = {node("a", {"a/x"}, {}), node("b", {}, {"a/x"})};
  EXPECT_NE(said("a/x", nodes).find("a/x (node a publishes it; heard by b)"), std::string::npos);
  EXPECT_EQ(said("a/y", nodes), "");
  EXPECT_EQ(said("a/x", nodes, {"a/x"}), "");
  EXPECT_EQ(said("a/x", nodes, {}, "a"), "") << "in its place";
}

TEST(LiveTopics, InputsOfOneAuthorAreNotForStrangers) {
  EXPECT_NE(said("a/x", {node("b", {}, {"a/x"}, "a")}).find("taken from node a alone; heard by b"),
            std::string::npos);
  EXPECT_NE(said("a/x", {node("b", {}, {"a/x"}, "first")}).find("may lead to motion; heard by b"),
            std::string::npos);
  EXPECT_EQ(said("a/x", {node("b", {}, {"a/x"}, "player")}), "");
  EXPECT_EQ(said("a/x", {node("b", {}, {"a/x"})}), "") << "it moves nothing";
}

TEST(LiveTopics, BesideABridgeNothingIsPlayedThatSomebodyReads) {
  std::vector nodes = {node("b", {}, {"a/x"}), node("bridge", {}, {})};
  nodes[1].add_services()->set_service("bridge/enable");
  EXPECT_NE(said("a/x", nodes).find("a/x (node bridge moves actuators; heard by b)"),
            std::string::npos);
  EXPECT_EQ(said("a/y", nodes), "") << "nobody reads it";
  EXPECT_EQ(said("a/x", nodes, {"a/x"}), "");
}

}  // namespace
}  // namespace mimesis::tool
