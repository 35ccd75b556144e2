// info, cat, check, recover, filter as people call them: exit codes and lines.
#include <nlohmann/json.hpp>

#include "common/testing/process.h"
#include "tools/mimesis/log/test/tool_logs.h"

namespace mimesis::tool {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;
using testing::Process;
using testlogs::log_bytes;

const std::string kText = MIMESIS_SOURCE_DIR "/LICENSE";  // no log

class LogTools : public testlogs::ToolLogs {
 protected:
  void SetUp() override {
    ToolLogs::SetUp();
    std::vector<testlogs::Sent> sent;
    for (std::uint32_t i = 0; i < 200; ++i) {
      sent.push_back({i % 2 == 0 ? "a/out" : "b/out", "a", i / 2 + 1, 1000 + i});
    }
    good_ = log_bytes(sent, {.attachment = "nodes: {}"});
    in_ = save("in.mcap", good_);
    std::string bad = good_;
    bad[400] = static_cast<char>(bad[400] ^ 1);
    bad_ = save("bad.mcap", bad);
    out_ = path("out.mcap");
  }
  /// Standard output.
  std::string run(std::vector<std::string> arguments, int code, const std::string& says = "") {
    arguments.insert(arguments.begin(), "log");
    Process process("mimesis", arguments);
    EXPECT_EQ(process.wait(60s), code) << process.errors();
    EXPECT_NE(process.errors().find(says), std::string::npos) << process.errors();
    return process.output();
  }
  std::string good_, in_, bad_, out_;
};

TEST_F(LogTools, Info) {
  EXPECT_EQ(json::parse(run({"info", in_, "--json"}, 0))["messages"], 200);
  EXPECT_EQ(json::parse(run({"info", in_, in_, "--sizes", "--json"}, 0))["files"].size(), 2u);
  run({"info", "/no/file.mcap"}, 3, "cannot open '/no/file.mcap'");
  run({"info", kText}, 1, "not an MCAP log");
  run({"info", save("empty.mcap", "")}, 1, "not an MCAP log");
  EXPECT_EQ(json::parse(run({"info", bad_, "--json"}, 1, "data section: CRC-32"))["messages"], 200);
  run({"info", save("cut.mcap", good_.substr(0, 400))}, 1, "byte");  // within the first chunk
}

TEST_F(LogTools, NoWordOfALogCommandsTheTerminal) {
  const std::string log =
      save("evil.mcap", log_bytes({{"a/\033[2J\x9b\u009bx", "n\007\n", 1, 1}, {"b", "b", 2, 2}}));
  for (const std::string verb : {"info", "check"}) {
    for (const std::string form : {"", "--json"}) {
      std::vector<std::string> words{verb, log};
      if (!form.empty()) words.push_back(form);
      const std::string out = run(words, 0);
      for (const char* bad : {"\033", "\007", "\x9b"}) EXPECT_EQ(out.find(bad), std::string::npos);
    }
  }
  EXPECT_NE(run({"info", log}, 0).find("a/\\u001b[2J"), std::string::npos);
}

TEST_F(LogTools, Cat) {
  const std::string lines = run({"cat", in_, "--topic", "b/out"}, 0);
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 100);
  EXPECT_EQ(run({"cat", in_, "--attachment", "launch.yaml"}, 0), "nodes: {}");
  run({"cat", in_, "--attachment", "launch.yml"}, 3, "did you mean 'launch.yaml'?");
  run({"cat", in_, "--metadata", "x"}, 3, "no metadata 'x'");
  run({"cat", in_, "--start", "x"}, 2, "--start: expected seconds");
  run({"cat", in_, "--bytes", "octal"}, 2, "--bytes");
  run({"cat", in_, "--field", "sequ"}, 2, "did you mean 'seq'?");
  run({"cat", bad_}, 1, "byte");
  run({"cat", "/no/file.mcap"}, 3, "cannot open '/no/file.mcap'");
  // A reader that has had enough.
  Process head("/bin/sh", {"-c", MIMESIS_BIN_DIR "/mimesis log cat " + in_ + " | head -n 1"});
  EXPECT_EQ(head.wait(60s), 0);
  EXPECT_EQ(head.errors(), "");
  Process full("/bin/sh", {"-c", MIMESIS_BIN_DIR "/mimesis log cat " + in_ + " > /dev/full"});
  EXPECT_EQ(full.wait(60s), 1);
  EXPECT_EQ(full.errors(), "cannot write to standard output: No space left on device\n");
}

TEST_F(LogTools, Check) {
  EXPECT_EQ(run({"check", in_}, 0, "0 errors, 0 warnings"), "");
  const std::string found = run({"check", bad_}, 1, "199 messages");
  EXPECT_EQ(found.substr(0, found.find("byte")), "error: " + bad_ + ": ");
  EXPECT_NE(run({"check", save("empty.mcap", "")}, 1).find("error: "), std::string::npos);
  EXPECT_GT(json::parse(run({"check", in_, bad_, "--json"}, 1))["errors"], 0);
  run({"check", "/no/file.mcap"}, 3, "cannot open '/no/file.mcap'");
}

TEST_F(LogTools, Recover) {
  run({"recover", in_, out_}, 0, "200 messages on 2 channels");
  run({"recover", in_, out_}, 2, "'" + out_ + "' exists: --force replaces it");
  const auto report = json::parse(run({"recover", bad_, "-o", out_, "--force", "--json"}, 1));
  EXPECT_EQ(report["lost"], true);
  run({"check", out_}, 0, "0 errors");
  run({"recover", in_, in_, "--force"}, 2, "is an input");
  run({"recover", kText, out_, "--force"}, 1, "not an MCAP log");
  run({"recover", in_}, 2, "say where to");
  EXPECT_EQ(bytes_of("in.mcap"), good_);
}

TEST_F(LogTools, Filter) {
  const auto report =
      json::parse(run({"filter", in_, out_, "--topic", "a/out", "--json"}, 0, "100 messages"));
  EXPECT_EQ(report["messages"], 100);
  run({"filter", in_, "-o", out_, "--force", "--compression", "zstd", "--level", "19"}, 0);
  run({"filter", in_, "-o", out_, "--force", "--compression", "lz4", "--chunk-size", "4KiB"}, 0);
  run({"filter", in_, "-o", out_, "--force", "--level", "20"}, 2, "--level");
  run({"filter", in_, "-o", out_, "--force", "--chunk-size", "1"}, 2, "--chunk-size");
  run({"filter", in_, "-o", out_, "--force", "--topic", "a/ou"}, 2, "did you mean 'a/out'?");
  run({"filter", in_, "-o", out_, "--force", "--inputs-of", "a"}, 3, "the log has no a/start");
  run({"filter", in_, "-o", out_, "--force", "--note", "commit=1a2b", "--note", "sum=a=b"}, 0);
  EXPECT_EQ(json::parse(run({"cat", out_, "--metadata", "mimesis.notes"}, 0)),
            (json{{"commit", "1a2b"}, {"sum", "a=b"}}));
  run({"filter", in_, "-o", out_, "--force", "--note", "commit"}, 2,
      "--note 'commit': expected KEY=VALUE");
  run({"filter", in_, "-o", out_, "--force", "--note", "=1"}, 2, "expected KEY=VALUE");
  run({"filter", in_, "-o", "/dev/full"}, 1, "No space left on device");
  run({"filter", in_, "-o", path("no/folder.mcap")}, 2, "cannot create");
  run({"filter", bad_, "-o", out_, "--force"}, 1, "byte");
}

TEST_F(LogTools, FilterJoinsLogs) {
  const auto report =
      json::parse(run({"filter", in_, in_, "-o", out_, "--offset", in_ + "=1", "--json"}, 0));
  EXPECT_EQ(report["messages"], 400);
  EXPECT_EQ(report["channels"], 2);
  EXPECT_EQ(report["attachments"], 1);
  run({"filter", in_, "-o", out_}, 2, "exists");
  run({"filter", in_, "-o", out_, "--force", "--offset", "x"}, 2, "expected FILE=SECONDS");
}

}  // namespace
}  // namespace mimesis::tool
