// `mimesis` runs the program of a verb, wherever that stands.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>

#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"

namespace mimesis::tool {
namespace {

namespace fs = std::filesystem;

class Verbs : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = getenv("PATH");
    setenv("PATH", folder_.path().c_str(), 1);  // alone: Mimesis may be installed on this machine
  }
  void TearDown() override { setenv("PATH", path_.c_str(), 1); }

  void add_script(const std::string& name, const std::string& text, bool executable = true) {
    std::ofstream(folder_ / name) << "#!/bin/sh\n" << text << '\n';
    if (executable) fs::permissions(folder_ / name, fs::perms::owner_all);
  }
  /// Exit code; the output is in `out_` and `err_`.
  int run(const std::string& program, const std::vector<std::string>& words) {
    testing::Process process(program, words);
    const int code = process.wait().value_or(-1);
    out_ = process.output();
    err_ = process.errors();
    return code;
  }
  int run(const std::vector<std::string>& words) { return run("mimesis", words); }

  testing::TemporaryFolder folder_;
  std::string path_, out_, err_;
};

TEST_F(Verbs, AProgramInPathIsAVerb) {
  add_script("mimesis-hello", "echo \"$# $2\"; exit 7");
  EXPECT_EQ(run({"hello", "a", "b c"}), 7);
  EXPECT_EQ(out_, "2 b c\n");
  EXPECT_EQ(run({"--help"}), 0);
  EXPECT_NE(out_.find("  hello         " + (folder_ / "mimesis-hello").string() + "\n"),
            std::string::npos)
      << out_;
  add_script("mimesis-topic", "echo mine");  // the one beside `mimesis` goes first
  EXPECT_EQ(run({"topic", "--help"}), 0);
  EXPECT_NE(out_, "mine\n");
}

TEST_F(Verbs, APartOfAVerbMayBeAProgramOfItsOwn) {
  add_script("mimesis-topic-mine", "echo \"$# $1 $2\"");
  add_script("mimesis-hello", "echo hello");
  add_script("mimesis-hello-world", "echo world");
  EXPECT_EQ(run({"topic", "mine", "a"}), 0);
  EXPECT_EQ(out_, "2 mine a\n");
  EXPECT_EQ(run({"topic", "--help"}), 0);
  EXPECT_NE(out_.find("echo"), std::string::npos) << "the other parts are where they were";
  EXPECT_EQ(run({"hello", "world"}), 0);
  EXPECT_EQ(out_, "hello\n") << "only parts of our verbs";
  EXPECT_EQ(run({"--help"}), 0);
  EXPECT_EQ(out_.find("topic-mine"), std::string::npos) << out_;
  EXPECT_NE(out_.find("hello-world"), std::string::npos) << out_;
}

TEST_F(Verbs, AMistakeIsNamedWithASuggestion) {
  add_script("mimesis-hello", "");
  add_script("mimesis-hallo", "", false);  // not a program
  EXPECT_EQ(run({"helo"}), 2);
  EXPECT_EQ(err_, "mimesis: unknown verb 'helo', did you mean 'hello'?\nSee: mimesis --help\n");
  EXPECT_EQ(run({"tpoic"}), 2);
  EXPECT_EQ(err_, "mimesis: unknown verb 'tpoic', did you mean 'topic'?\nSee: mimesis --help\n");
  EXPECT_EQ(run({"../bin/mimesis-topic"}), 2);
  EXPECT_EQ(run({"--no-such"}), 2);
  EXPECT_EQ(err_, "mimesis: unknown option '--no-such'\nSee: mimesis --help\n");
  EXPECT_EQ(run({}), 2);
  EXPECT_EQ(err_, "mimesis: expected a verb\nSee: mimesis --help\n");
}

TEST_F(Verbs, AMissingProgramIsNamed) {
  const fs::path alone = folder_ / "mimesis";
  fs::copy_file(fs::path(MIMESIS_BIN_DIR) / "mimesis", alone);
  EXPECT_EQ(run(alone.string(), {"topic", "list"}), 2);
  EXPECT_EQ(err_,
            "mimesis: the program of verb 'topic' is missing: mimesis-topic is neither beside this "
            "one nor in PATH; in a source tree: cmake --build build --target mimesis-topic\nSee: "
            "mimesis --help\n");
  EXPECT_EQ(out_, "");
  EXPECT_EQ(run(alone.string(), {"--help"}), 0);
  EXPECT_EQ(out_.find("  topic "), std::string::npos) << out_;
}

TEST_F(Verbs, HelpOfAVerbIsItsOwnAndAgreesWithTheList) {
  ASSERT_EQ(run({"help"}), 0);
  const std::string list = out_;
  for (const std::string verb : {"topic", "node", "launch"}) {
    ASSERT_EQ(run({"help", verb}), 0);
    const std::string help = out_;
    ASSERT_EQ(run({verb, "--help"}), 0);
    EXPECT_EQ(out_, help);
    const std::string about = help.substr(0, help.find('\n'));
    EXPECT_NE(list.find(about + "\n"), std::string::npos) << about << " is not in\n" << list;
  }
  EXPECT_EQ(run({"help", "tpoic"}), 2);
  EXPECT_EQ(run({"--version"}), 0);
  EXPECT_TRUE(out_.starts_with("mimesis ")) << out_;
}

}  // namespace
}  // namespace mimesis::tool
