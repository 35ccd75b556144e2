#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <sstream>

#include "tools/mimesis/rate_window.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {
using namespace std::chrono_literals;

TEST(Table, AlignsByCharactersNotBytes) {
  Table table({"NAME", "X"});
  table.row({"größe", "1"});
  table.row({"ab", "22"});
  std::ostringstream out;
  table.print(out, false);
  EXPECT_EQ(out.str(), "NAME   X\ngröße  1\nab     22\n");
}

TEST(Table, WordsOfOthersCannotCommandTheTerminal) {
  EXPECT_EQ(printable("größe 漢 \U0001F600 a\\b"), "größe 漢 \U0001F600 a\\b");
  EXPECT_EQ(printable("\033[2J\n\x7f\u009b"), "\\u001b[2J\\u000a\\u007f\\u009b");
  EXPECT_EQ(printable("\x9b\xe6\xbc"), "\\u009b\\u00e6\\u00bc");
  EXPECT_EQ(printable("a\n\tb", "\n"), "a\n\\u0009b");
  Table table({"TOPIC"});
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

}  // namespace
}  // namespace mimesis::tool
