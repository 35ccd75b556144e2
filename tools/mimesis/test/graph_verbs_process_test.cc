// `mimesis param|service|graph|completion|doctor`, `topic pub|info|bw|delay` and `node info` on a
// graph with real nodes.
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common/machine_time.h"
#include "common/testing/process.h"

namespace mimesis::tool {
namespace {

/// A program on a terminal of its own.
class OnTerminal {
 public:
  /// @param words  path of the program and its arguments
  explicit OnTerminal(std::vector<std::string> words) {
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_ = forkpty(&terminal_, nullptr, nullptr, nullptr);
    if (pid_ == 0) {
      execv(argv[0], argv.data());
      _exit(127);
    }
  }
  ~OnTerminal() {
    if (!ended_) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(terminal_);
  }
  OnTerminal(const OnTerminal&) = delete;
  OnTerminal& operator=(const OnTerminal&) = delete;

  void type(const std::string& keys) const {
    ASSERT_EQ(write(terminal_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  /// Waits until the screen shows `text` after the text seen before; returns the screen if not.
  ::testing::AssertionResult shows(const std::string& text) {
    MachineTime time;
    for (;;) {
      if (const std::size_t at = screen_.find(text); at != std::string::npos) {
        screen_.erase(0, at + text.size());
        return ::testing::AssertionSuccess();
      }
      pollfd item{terminal_, POLLIN, 0};
      char bytes[4096];
      ssize_t n = -1;
      if (poll(&item, 1, 100) > 0) n = read(terminal_, bytes, sizeof bytes);
      if (n > 0) screen_.append(bytes, static_cast<std::size_t>(n));
      if (time.passed() > std::chrono::seconds(10)) {
        return ::testing::AssertionFailure() << "no '" << text << "' in: " << screen_;
      }
    }
  }
  /// Line by line with echo: as a shell expects it.
  bool cooked() const {
    termios now{};
    EXPECT_EQ(tcgetattr(terminal_, &now), 0);
    return (now.c_lflag & ICANON) != 0 && (now.c_lflag & ECHO) != 0;
  }
  void signal(int number) const { kill(pid_, number); }
  int wait() {
    int raw = 0;
    waitpid(pid_, &raw, 0);
    ended_ = true;
    return WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
  }
  bool stopped() const {
    int raw = 0;
    return waitpid(pid_, &raw, WUNTRACED) == pid_ && WIFSTOPPED(raw);
  }

 private:
  int terminal_ = -1;
  pid_t pid_ = -1;
  bool ended_ = false;
  std::string screen_;
};

using namespace std::chrono_literals;
using nlohmann::json;
using testing::Process;

class GraphVerbs : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(node_.wait_ready(graph_, "a")) << node_.errors(); }

  struct Result {
    std::string out, err;
    int code;
    json parsed() const { return json::parse(out, nullptr, false); }
  };
  /// `mimesis ARGUMENTS --graph G`.
  Result run(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--graph", graph_.name()});
    Process p("mimesis", arguments);
    const int code = p.wait().value_or(-1);
    return {p.output(), p.errors(), code};
  }
  std::string value(const std::string& key) { return run({"param", "get", "a", key}).out; }

  testing::TestGraph graph_;
  Process node_{graph_, MIMESIS_COUNTER, {"--name", "a", "--in", "a=other/out"}};
};

TEST_F(GraphVerbs, ParamListSaysWhatMayChange) {
  const Result all = run({"param", "list", "a", "--json"});
  ASSERT_EQ(all.code, 0) << all.err;
  json found;
  for (const json& p : all.parsed()) found[p["key"].get<std::string>()] = p;
  EXPECT_EQ(found["salt"]["changeable"], true);
  EXPECT_EQ(found["rate_hz"]["changeable"], false);
  EXPECT_EQ(found["rate_hz"]["unit"], "Hz");
  EXPECT_EQ(found["rate_hz"]["value"], 100.0);
  EXPECT_EQ(found["mode"]["allowed"], "one of mix, refuse, needs");
  EXPECT_NE(run({"param", "list"}).out.find("a.salt"), std::string::npos);
}

TEST_F(GraphVerbs, ParamSetTakesAllValuesOrNone) {
  EXPECT_EQ(run({"param", "set", "a", "salt", "5"}).code, 0);
  EXPECT_EQ(value("salt"), "5\n");
  const Result two = run({"param", "set", "a", "salt=7", "work=3", "--json"});
  EXPECT_EQ(two.code, 0) << two.err;
  ASSERT_EQ(two.parsed().size(), 2U) << two.out;
  EXPECT_EQ(two.parsed()[0]["key"], "work");
  EXPECT_EQ(two.parsed()[0]["before"], 0);
  EXPECT_EQ(two.parsed()[1]["value"], 7);

  const Result outside = run({"param", "set", "a", "work=4", "salt=-1"});
  EXPECT_EQ(outside.code, 2);
  EXPECT_EQ(outside.err, "a.salt: -1 is outside [0, 1000000000]\n");
  EXPECT_EQ(value("work"), "3\n");
  const Result refused = run({"param", "set", "a", "salt", "13"});  // by the node itself
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("13 brings bad luck"), std::string::npos) << refused.err;
  EXPECT_EQ(value("salt"), "7\n");
  const Result fixed = run({"param", "set", "a", "rate_hz", "50"});
  EXPECT_EQ(fixed.code, 2);
  EXPECT_NE(fixed.err.find("a.rate_hz: cannot change while the node runs"), std::string::npos);
  const Result typo = run({"param", "set", "a", "sallt", "1"});
  EXPECT_EQ(typo.code, 2);
  EXPECT_NE(typo.err.find("did you mean 'salt'?"), std::string::npos) << typo.err;
}

TEST_F(GraphVerbs, ParamDumpIsWhatLoadAndTheNodeRead) {
  const std::string file = ::testing::TempDir() + "graph_verbs_a.yaml";
  EXPECT_EQ(run({"param", "dump", "a", "-o", file}).code, 0);
  EXPECT_NE(run({"param", "load", "a", file}).err.find("all values of"), std::string::npos);
  EXPECT_EQ(run({"param", "set", "a", "salt", "99"}).code, 0);
  EXPECT_EQ(run({"param", "load", "a", file}).code, 0);
  EXPECT_EQ(value("salt"), "0\n");
  Process again(graph_, MIMESIS_COUNTER, {"--name", "b", "--params", file, "--check"});
  EXPECT_EQ(again.wait(), 0) << again.errors();
  std::ofstream(file) << "rate_hz: 50\n";
  EXPECT_EQ(run({"param", "load", "a", file}).code, 2);
  std::filesystem::remove(file);
}

TEST_F(GraphVerbs, WhatIsNotThereIsThree) {
  const Result node = run({"param", "get", "aa", "salt"});
  EXPECT_EQ(node.code, 3);
  EXPECT_NE(node.err.find("no node 'aa' in graph"), std::string::npos) << node.err;
  EXPECT_NE(node.err.find("did you mean 'a'?"), std::string::npos) << node.err;
  EXPECT_EQ(run({"param", "get", "a", "sallt"}).code, 3);
  EXPECT_EQ(run({"node", "info", "b"}).code, 3);
  EXPECT_EQ(run({"service", "call", "a/add_two"}).code, 3);
  EXPECT_EQ(run({"topic", "info", "a/outt"}).code, 3);
  EXPECT_EQ(run({"topic", "pub", "x/y", "{}"}).code, 3);
  EXPECT_EQ(run({"param"}).code, 2);
}

TEST_F(GraphVerbs, ServiceCallSpeaksJson) {
  const Result sum = run({"service", "call", "a/add_one", R"({"seq": 41})", "--json"});
  EXPECT_EQ(sum.code, 0) << sum.err;
  EXPECT_EQ(sum.parsed()["seq"], 42);
  json services;
  for (const json& s : run({"service", "list", "--json"}).parsed())
    services[s["service"].get<std::string>()] = s;
  EXPECT_EQ(services["a/add_one"]["request"], "mimesis.v1.Publication");
  const Result wrong = run({"service", "call", "a/add_one", R"({"seqq": 41})"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_NE(wrong.err.find("seqq"), std::string::npos) << wrong.err;
}

TEST_F(GraphVerbs, EchoWaitsForTheMessageThatIsWanted) {
  const Result now = run({"topic", "echo", "a/out", "--once", "--field", "seq"});
  ASSERT_EQ(now.code, 0) << now.err;
  const std::string later = std::to_string(std::stoull(now.out) + 300);
  const Result wanted =
      run({"topic", "echo", "a/out", "--where", "seq=" + later, "--once", "--field", "seq"});
  EXPECT_EQ(wanted.code, 0) << wanted.err;
  EXPECT_EQ(wanted.out, later + "\n");
  EXPECT_EQ(run({"topic", "echo", "a/out", "--where", "seq=0", "--once", "--timeout", "0.2"}).code,
            3);
  EXPECT_EQ(run({"topic", "echo", "a/out", "--where", "seq", "--once"}).code, 2);
}

TEST_F(GraphVerbs, PubTakesWhatEchoPrints) {
  // The counter hears other/out: its hash changes with what comes.
  testing::TestNode peer(graph_, {{"copy", "copy/out"}}, {});
  runtime::Reliable<v1::Publication> copy(peer.bus(), "copy");
  peer.open();
  const Result echoed = run({"topic", "echo", "a/out", "-n", "3", "--json"});
  ASSERT_EQ(echoed.code, 0);
  const std::string lines = ::testing::TempDir() + "graph_verbs_lines";
  std::ofstream(lines) << echoed.out;
  const auto bin = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "../bin";
  Process pub("/bin/sh", {"-c", (bin / "mimesis topic pub copy/out --stdin --graph ").string() +
                                    graph_.name() + " --json < " + lines});
  for (int line = 0; line < 3; ++line) {
    const auto message = peer.receive(copy);
    ASSERT_TRUE(message) << line;
    EXPECT_EQ(message->topic(), "counter");
    EXPECT_GT(message->start_id(), 0U);
  }
  EXPECT_EQ(pub.wait(), 0) << pub.errors();
  EXPECT_EQ(json::parse(pub.output())["messages"], 3);
  std::filesystem::remove(lines);

  Process once("mimesis", {"topic", "pub", "copy/out", R"({"seq": 12})", "--graph", graph_.name()});
  const auto message = peer.receive(copy);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->seq(), 12U);
  EXPECT_EQ(once.wait(), 0) << once.errors();
  EXPECT_EQ(run({"topic", "pub", "copy/out", R"({"seqq": 1})"}).code, 2);
}

TEST_F(GraphVerbs, TopicInfoBandwidthAndDelay) {
  const json info = run({"topic", "info", "other/out", "--json"}).parsed();
  EXPECT_EQ(info["type"], "mimesis.v1.Publication");
  EXPECT_EQ(info["subscribers"][0]["node"], "a");
  EXPECT_EQ(info["subscribers"][0]["policy"], "reliable");
  EXPECT_TRUE(info["empty_message"].contains("seq"));
  const json bw = run({"topic", "bw", "a/out", "-n", "1", "--json"}).parsed();
  EXPECT_GT(bw["bytes_s"], 0.0);
  EXPECT_LE(bw["min_bytes"], bw["mean_bytes"]);
  const json delay = run({"topic", "delay", "a/out", "-n", "1", "--json"}).parsed();
  EXPECT_GE(delay["max_s"], delay["min_s"]);
  EXPECT_GT(delay["mean_s"], -1.0);  // of the same clock
  const Result node = run({"node", "info", "a"});
  EXPECT_EQ(node.code, 0);
  EXPECT_NE(node.out.find("other/out"), std::string::npos) << node.out;
}

TEST_F(GraphVerbs, ASecondTerminalFindsTheGraph) {
  json mine;
  Process list("mimesis", {"graph", "list", "--json"});
  EXPECT_EQ(list.wait(), 0);
  for (const json& graph : json::parse(list.output())) {
    if (graph["graph"] == graph_.name()) mine = graph;
  }
  EXPECT_EQ(mine["nodes"], json::array({"a"}));
  EXPECT_EQ(mine["clock"], "wall");
}

TEST_F(GraphVerbs, CompletionKnowsVerbsOptionsAndLiveNames) {
  const auto complete = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "__complete");
    Process p("mimesis", words);
    EXPECT_EQ(p.wait(), 0) << p.errors();
    return p.output();
  };
  EXPECT_EQ(complete({"par"}), "param\n");
  EXPECT_EQ(complete({"param", "s"}), "set\n");
  EXPECT_EQ(complete({"topic", "echo", "--rel"}), "--reliable\n");
  const std::string graph = "--graph=" + graph_.name();
  EXPECT_EQ(complete({"topic", "echo", graph, "a/o"}), "a/out\n");
  EXPECT_EQ(complete({"param", "get", graph, ""}), "a\n");
  EXPECT_EQ(complete({"param", "get", graph, "a", "sa"}), "salt\n");
  EXPECT_EQ(complete({"param", "set", graph, "a", ""}), "salt\nwork\n") << "only what may change";
  EXPECT_EQ(complete({"service", "call", graph, "a/add"}), "a/add_one\n");
  EXPECT_EQ(complete({"nonsense", "x"}), "");
  EXPECT_NE(complete({"topic", "echo", "--graph", graph_.name().substr(0, 4)}).find(graph_.name()),
            std::string::npos);
  for (const char* shell : {"bash", "zsh", "fish"}) {
    Process p("mimesis", {"completion", shell});
    EXPECT_EQ(p.wait(), 0);
    EXPECT_NE(p.output().find("__complete"), std::string::npos) << shell;
  }
}

TEST_F(GraphVerbs, BashCompletesThroughTheScript) {
  const auto bin = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "../bin";
  Process bash("/bin/bash", {"-c", "PATH=" + bin.string() +
                                       ":$PATH; eval \"$(mimesis completion bash)\"; "
                                       "COMP_WORDS=(mimesis topic ec); COMP_CWORD=2; _mimesis; "
                                       "echo \"${COMPREPLY[@]}\""});
  EXPECT_EQ(bash.wait(), 0) << bash.errors();
  EXPECT_EQ(bash.output(), "echo\n");
}

TEST_F(GraphVerbs, TopShowsLoadAndHealth) {
  const Result top = run({"top", "-n", "2", "--json"});
  EXPECT_EQ(top.code, 0) << top.err;
  const std::string line = top.out.substr(top.out.find('\n') + 1);
  const json nodes = json::parse(line)["nodes"];
  ASSERT_EQ(nodes.size(), 1U) << line;
  EXPECT_EQ(nodes[0]["node"], "a");
  EXPECT_GT(nodes[0]["memory_bytes"], 1'000'000);
  EXPECT_GE(nodes[0]["cpu_percent"], 0.0);
  EXPECT_EQ(nodes[0]["dropped"], 0) << line;
  EXPECT_GE(nodes[0]["worst_step_s"], nodes[0]["mean_step_s"]);
  EXPECT_NE(run({"top", "-n", "1"}).out.find("STEP MEAN"), std::string::npos);
}

TEST_F(GraphVerbs, TopShowsHowOldMessagesAreWhenTheyAreTaken) {
  Process other(graph_, MIMESIS_COUNTER, {"--name", "other", "--set", "rate_hz=200"});
  ASSERT_TRUE(other.wait_ready(graph_, "other"));
  const Result top = run({"top", "-n", "4", "--json"});
  EXPECT_EQ(top.code, 0) << top.err;
  const std::size_t before = top.out.rfind('\n', top.out.size() - 2);
  const json input = json::parse(top.out.substr(before + 1))["nodes"][0]["inputs"][0];
  EXPECT_EQ(input["topic"], "other/out");
  // It steps each 10 ms, and takes messages that come in between: each 5 ms.
  EXPECT_NEAR(input["messages_s"], 200.0, 100.0) << input;
  EXPECT_GT(input["latency_p50_s"], 0.0) << input;
  EXPECT_GE(input["latency_p99_s"], input["latency_p50_s"]) << input;
  EXPECT_LT(input["latency_p50_s"], 0.5) << input;
  EXPECT_EQ(input["queued"], 0) << input;
}

TEST_F(GraphVerbs, KeysOfTopChooseANodeMakeItLogMoreAndStopIt) {
  const std::string graph = graph_.name();
  OnTerminal top({MIMESIS_BIN_DIR "/mimesis", "top", "--graph", graph});
  EXPECT_TRUE(top.shows("l: log level"));
  EXPECT_TRUE(top.shows("INPUTS OF a"));  // with its first health
  top.type("l");
  EXPECT_TRUE(top.shows("a logs from debug on"));
  Process other(graph_, MIMESIS_COUNTER, {"--name", "other"});
  ASSERT_TRUE(other.wait_ready(graph_, "other"));
  EXPECT_TRUE(top.shows("DEBUG: node other of host"));
  top.type("l");
  EXPECT_TRUE(top.shows("a logs from info on"));
  EXPECT_TRUE(top.shows("other"));
  top.type("j");
  EXPECT_TRUE(top.shows(">  other"));
  top.type("s");
  EXPECT_TRUE(top.shows("s again: stops node other"));
  top.type("s");
  EXPECT_TRUE(top.shows("other was told"));
  EXPECT_EQ(other.wait(), 0);
  top.type("q");
  EXPECT_EQ(top.wait(), 0);
  const Result level = run({"service", "call", "a/params", R"({"log_level": "loud"})"});
  EXPECT_EQ(level.code, 1);
  EXPECT_NE(level.err.find("log level 'loud': expected one of debug, info, warn, error"),
            std::string::npos)
      << level.err;
}

TEST_F(GraphVerbs, TheTerminalIsRestoredHoweverTopEnds) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGSEGV, SIGABRT}) {
    OnTerminal top({MIMESIS_BIN_DIR "/mimesis", "top", "--graph", graph_.name()});
    EXPECT_TRUE(top.shows("l: log level"));
    EXPECT_FALSE(top.cooked());
    if (signal == SIGINT) {
      top.signal(SIGTSTP);
      ASSERT_TRUE(top.stopped());
      EXPECT_TRUE(top.cooked()) << "a suspended one leaves it to others";
      top.signal(SIGCONT);
    }
    top.signal(signal);
    top.wait();
    EXPECT_TRUE(top.cooked()) << signal;
  }
}

TEST_F(GraphVerbs, DoctorSaysWhatToDo) {
  Process doctor("mimesis", {"doctor", "--json"});
  EXPECT_EQ(doctor.wait(), 0) << doctor.errors();
  std::map<std::string, json> found;
  for (const json& f : json::parse(doctor.output())) found[f["check"]] = f;
  for (const char* check : {"real-time priority", "CPU frequency", "clock", "sockets", "CAN",
                            "disk", "versions", "open files", "locked memory"}) {
    ASSERT_TRUE(found.contains(check)) << check;
    const json& f = found[check];
    const bool bad = f["state"] == "warning" || f["state"] == "problem";
    EXPECT_TRUE(!bad || f["advice"] != "") << check;
  }
  EXPECT_EQ(found["sockets"]["state"], "ok");
}

}  // namespace
}  // namespace mimesis::tool
