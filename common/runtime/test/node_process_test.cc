#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "proto/foxglove/log.pb.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

constexpr const char* kCounter = MIMESIS_COUNTER;

TEST(NodeProcess, StepsAtItsRateAndStopsOnRequest) {
  TestGraph graph;
  TestNode peer(graph, {{"count", "counter/out"}}, {});
  Reliable<v1::Publication> count(peer.bus(), "count");
  peer.open();
  Process node(graph, kCounter, {"--set", "rate_hz=200"});
  ASSERT_TRUE(node.wait_ready(graph, "counter")) << node.errors();
  const auto first = peer.receive(count);
  ASSERT_TRUE(first);
  const auto begin = TestNode::now();
  std::optional<v1::Publication> last;
  while ((last = peer.receive(count)) && last->seq() < first->seq() + 40) {
  }
  ASSERT_TRUE(last);
  EXPECT_GT(to_seconds(TestNode::now() - begin), 0.15);  // 40 steps take 0.2 s
  EXPECT_EQ(node.terminate(), 0);
  EXPECT_NE(node.errors().find("stopped after"), std::string::npos);
  EXPECT_TRUE(GraphView(graph.name()).nodes().size() == 1);  // the test's own
}

TEST(NodeProcess, MessagesReachItAndItsHealthCountsThem) {
  TestGraph graph;
  TestNode peer(graph, {{"health", "counter/health"}}, {{"a", "test/a"}});
  Reliable<v1::Health> health(peer.bus(), "health");
  Out<v1::Publication> a(peer.bus(), "a");
  peer.open();
  Process node(graph, kCounter, {"--in", "a=test/a"});
  ASSERT_TRUE(peer.wait_subscriber(a)) << node.errors();
  v1::Publication m;
  for (int i = 0; i < 5; ++i) a.send(m, TestNode::now());
  std::optional<v1::Health> h;
  do {
    h = peer.receive(health);
    ASSERT_TRUE(h);
  } while (h->inputs(0).received() < 5);
  EXPECT_EQ(h->inputs(0).received(), 5U);
  EXPECT_EQ(h->inputs(0).lost(), 0U);
  EXPECT_EQ(h->inputs(0).topic(), "test/a");
  EXPECT_GT(h->steps(), 50U);
  EXPECT_GT(h->worst_step_s(), 0.0);
  EXPECT_GE(h->worst_step_s(), h->mean_step_s());
}

/// A socket as systemd has one for a service.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& path) : fd_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  }
  ~NotifySocket() { close(fd_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;
  /// Words up to the first that begins so; the last is empty if it does not come.
  std::vector<std::string> until(std::string_view last) const {
    std::vector<std::string> words;
    const timeval most{10, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &most, sizeof most);
    do {
      std::array<char, 256> word{};
      const ssize_t n = recv(fd_, word.data(), word.size(), 0);
      words.emplace_back(word.data(), n > 0 ? static_cast<std::size_t>(n) : 0);
    } while (!words.back().empty() && !words.back().starts_with(last));
    return words;
  }

 private:
  int fd_;
};

TEST(NodeProcess, TellsItsServiceManagerAndItsLauncherHowItFares) {
  TestGraph graph;
  const std::string system = graph.directory() + "/system",
                    launcher = graph.directory() + "/launcher";
  const NotifySocket of_system(system), of_launcher(launcher);
  Process node("/usr/bin/env", {"NOTIFY_SOCKET=" + system, "WATCHDOG_USEC=2000000",
                                "MIMESIS_NOTIFY_SOCKET=" + launcher, "MIMESIS_WATCHDOG_USEC=200000",
                                kCounter, "--graph", graph.name()});
  for (const NotifySocket* socket : {&of_system, &of_launcher}) {
    EXPECT_EQ(socket->until("READY=").back(), "READY=1");
    EXPECT_NE(socket->until("STATUS=").back().find(" overruns"), std::string::npos);
  }
  const auto of_life = [](const NotifySocket& socket) {
    return std::ranges::count(socket.until("STATUS="), "WATCHDOG=1");  // a second
  };
  const auto seen = of_life(of_system);
  EXPECT_GE(seen, 1);
  EXPECT_LE(seen, 3);                  // every 0.5 s
  EXPECT_GE(of_life(of_launcher), 8);  // every 50 ms
  EXPECT_EQ(node.terminate(), 0);
  EXPECT_EQ(of_system.until("STOPPING=").back(), "STOPPING=1");
  EXPECT_EQ(of_launcher.until("STOPPING=").back(), "STOPPING=1");
}

TEST(NodeProcess, SaysWhichInputItWaitsFor) {
  TestGraph graph;
  const std::string system = graph.directory() + "/system";
  const NotifySocket status(system);
  TestNode peer(graph, {}, {{"b", "test/b"}});
  Out<v1::Publication> b(peer.bus(), "b");
  peer.open();
  Process node("/usr/bin/env", {"NOTIFY_SOCKET=" + system, kCounter, "--graph", graph.name(),
                                "--set", "mode=needs", "--in", "b=test/b"});
  EXPECT_EQ(status.until("STATUS=").back().find("STATUS=waits for test/b, 1 s so far; "), 0U);
  ASSERT_TRUE(peer.wait_subscriber(b)) << node.errors();
  v1::Publication m;
  b.send(m, TestNode::now());
  std::string line;
  for (int k = 0; k < 3; ++k) line = status.until("STATUS=").back();  // one may be on its way
  EXPECT_EQ(line.find("waits for"), std::string::npos) << line;
}

TEST(NodeProcess, LocksItsMemoryOrDoesNotStart) {
  TestGraph graph;
  Process node(graph, kCounter, {"--mlock"});
  const std::string status = "/proc/" + std::to_string(node.pid()) + "/status";
  if (node.wait_ready(graph, "counter")) {  // else this machine locks nothing
    std::ifstream in(status);
    std::string line;
    while (std::getline(in, line) && !line.starts_with("VmLck:")) {
    }
    EXPECT_GT(std::stol(line.substr(6)), 1000) << line;  // kB
    EXPECT_EQ(node.terminate(), 0);
  }
  Process small("/usr/bin/setpriv",
                {"--bounding-set=-ipc_lock", "/usr/bin/prlimit", "--memlock=65536", kCounter,
                 "--graph", graph.name(), "--mlock"});
  if (geteuid() != 0) return;  // the bounding set is root's to change
  EXPECT_EQ(small.wait(), 2);
  EXPECT_EQ(small.errors().find("--mlock: memory cannot be locked: "), 0U) << small.errors();
  EXPECT_NE(small.errors().find("at most 64 kB"), std::string::npos) << small.errors();
}

/// Lines of counter/log for a recorder that was there first. A node waits for recorders only.
class LogLines {
 public:
  explicit LogLines(const TestGraph& graph)
      : tap_(
            graph.name(), [](const std::string& topic) { return topic == "counter/log"; },
            Policy::reliable) {}
  /// The next line that starts with `start`.
  std::optional<foxglove::Log> next(std::string_view start) {
    foxglove::Log line;
    while (const auto tapped = tap_.next(10s)) {
      if (line.ParseFromString(tapped->message.payload) && line.message().starts_with(start)) {
        return line;
      }
    }
    return std::nullopt;
  }

 private:
  Tap tap_;
};

TEST(NodeProcess, SaysInOneLineWhatIsNotDefaultAndRecordsAll) {
  TestGraph graph;
  LogLines lines(graph);
  Process node(graph, kCounter, {"--set", "rate_hz=200"});
  const auto line = lines.next("parameters:\n");
  ASSERT_TRUE(line) << node.errors();
  EXPECT_NE(line->message().find("\nrate_hz: 200\n"), std::string::npos) << line->message();
  EXPECT_NE(line->message().find("\nwork: "), std::string::npos) << line->message();
  EXPECT_NE(node.errors().find("info: ready: rate_hz=200\n"), std::string::npos) << node.errors();
}

TEST(NodeProcess, OverrunsAreCountedNotMadeUpFor) {
  TestGraph graph;
  TestNode peer(graph, {{"health", "counter/health"}}, {});
  Reliable<v1::Health> health(peer.bus(), "health");
  peer.open();
  Process node(graph, kCounter, {"--set", "rate_hz=1000", "--set", "work=2000000"});
  const auto h = peer.receive(health);
  ASSERT_TRUE(h) << node.errors();
  EXPECT_GT(h->overruns(), 0U);
  EXPECT_LT(h->steps(), 1000U);
}

TEST(NodeProcess, MistakesOnTheCommandLineExitWith2) {
  const auto mistake = [](std::vector<std::string> arguments) {
    TestGraph graph;
    Process node(graph, kCounter, std::move(arguments));
    EXPECT_EQ(node.wait(), 2) << node.errors();
    return node.errors();
  };
  EXPECT_NE(mistake({"--sett", "rate_hz=1"}).find("did you mean '--set'"), std::string::npos);
  EXPECT_NE(mistake({"--set", "rate_hz=0"}).find("rate_hz"), std::string::npos);
  EXPECT_NE(mistake({"--set", "mode=refuse"}).find("counter.mode: refuses"), std::string::npos);
  EXPECT_NE(mistake({"--in", "aa=x/y"}).find("has no input 'aa'"), std::string::npos);
  EXPECT_NE(mistake({"--in", "a"}).find("expected PORT=NAME"), std::string::npos);
  EXPECT_NE(mistake({"--clock", "lock"}).find("lockstep"), std::string::npos);
  EXPECT_NE(mistake({"--name", "a/b"}).find("node name 'a/b'"), std::string::npos);
}

TEST(NodeProcess, CheckAndHelpPrintOnlyWhatTheyShould) {
  Process check(kCounter, {"--check", "--set", "rate_hz=10"});
  EXPECT_EQ(check.wait(), 0);
  EXPECT_EQ(check.output() + check.errors(), "");
  Process help(kCounter, {"--help"});
  EXPECT_EQ(help.wait(), 0);
  EXPECT_NE(help.output().find("fail_at_step"), std::string::npos);
  EXPECT_NE(help.output().find("mimesis.v1.Publication       latest, of one node, optional"),
            std::string::npos);
  EXPECT_NE(help.output().find("Examples"), std::string::npos);
}

TEST(NodeProcess, DescribesItselfWithoutSockets) {
  TestGraph graph;
  Process describe(graph, kCounter, {"--describe", "--set", "work=3", "--set", "mode=refuse"});
  EXPECT_EQ(describe.wait(), 0) << describe.errors();
  EXPECT_EQ(describe.errors(), "");
  EXPECT_TRUE(std::filesystem::is_empty(graph.directory()));
  const auto says = [&](const std::string& text) {
    EXPECT_NE(describe.output().find(text), std::string::npos) << text << describe.output();
  };
  says(R"({"program":"mimesis_counter")");
  says(R"("complete":true)");
  says(R"({"name":"latest","direction":"in","type":"mimesis.v1.Publication","policy":"latest",)"
       R"("optional":true,"sole":true})");
  says(R"({"name":"out","direction":"out","type":"mimesis.v1.Publication","latched":false})");
  says(R"({"name":"health","direction":"out","type":"mimesis.v1.Health")");
  says(R"({"name":"add_one","request":"mimesis.v1.Publication")");
  says(R"({"key":"work","type":"integer","default":0,"value":3,)");
  says(R"("unit":"Hz","range":[0.1,10000.0])");
  says(R"("choices":["mix","refuse","needs"])");
  Process check(graph, kCounter, {"--check", "--set", "mode=refuse"});
  EXPECT_EQ(check.wait(), 2);
  EXPECT_EQ(check.errors(), "--set: counter.mode: refuses\n");
}

TEST(NodeProcess, AnExceptionInAStepStopsTheNodeWithExitCode1) {
  TestGraph graph;
  Process node(graph, kCounter, {"--set", "fail_at_step=3"});
  EXPECT_EQ(node.wait(), 1);
  EXPECT_NE(node.errors().find("step failed: asked to fail"), std::string::npos);
  EXPECT_NE(node.errors().find("stopped after 3 steps"), std::string::npos);
}

TEST(NodeProcess, ItsLogLinesAreATopic) {
  TestGraph graph;
  LogLines lines(graph);
  Process node(graph, kCounter, {});
  ASSERT_TRUE(lines.next("parameters:")) << node.errors();
  node.signal(SIGTERM);
  const auto line = lines.next("stopped after");
  ASSERT_TRUE(line) << node.errors();
  EXPECT_EQ(line->name(), "counter");
  EXPECT_EQ(line->level(), foxglove::Log::INFO);
  EXPECT_EQ(node.wait(), 0);
}

TEST(NodeProcess, SettingTheSystemClockMovesNothingAndIsReported) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "no such case: a sanitizer must be the first library";
#endif
  TestGraph graph;
  const std::string file = graph.directory() + "/test_clock";
  const auto set_clock = [&](std::int64_t seconds) {
    std::fstream(file, std::ios::in | std::ios::out)
        .write(reinterpret_cast<const char*>(&seconds), sizeof seconds);
  };
  std::ofstream(file).write("\0\0\0\0\0\0\0\0", 8);
  Tap tap(
      graph.name(), [](const std::string& topic) { return topic == "counter/out"; },
      Policy::reliable);
  setenv("MIMESIS_TEST_CLOCK", file.c_str(), 1);
  setenv("LD_PRELOAD", MIMESIS_PRELOADED_CLOCK, 1);
  Process node(graph, kCounter, {"--set", "rate_hz=100"});
  unsetenv("LD_PRELOAD");
  unsetenv("MIMESIS_TEST_CLOCK");
  const auto next_stamp = [&] {
    const auto message = tap.next(2s);
    return message ? message->message.stamp : Time(0);
  };
  Time last = next_stamp();
  for (const std::int64_t ahead_s : {-5, 5, -60, 60, -3600, 3600}) {
    set_clock(ahead_s);
    for (int n = 0; n < 20; ++n) {
      const Time next = next_stamp();
      ASSERT_GT(next, last) << ahead_s << " s: " << node.errors();
      EXPECT_LT(next, last + 1s) << ahead_s;
      last = next;
    }
  }
  EXPECT_EQ(node.terminate(), 0);
  for (const std::string by : {"-5.000", "+10.000", "-65.000", "+120.000", "-3660.000"}) {
    EXPECT_NE(node.errors().find("the system clock was set by " + by), std::string::npos)
        << by << ": " << node.errors();
  }
}

TEST(NodeProcess, ASecondNodeOfTheSameNameIsRefused) {
  TestGraph graph;
  Process first(graph, kCounter, {});
  ASSERT_TRUE(first.wait_ready(graph, "counter"));
  Process second(graph, kCounter, {});
  EXPECT_EQ(second.wait(), 2);
  EXPECT_NE(second.errors().find("runs already"), std::string::npos);
  EXPECT_NE(second.errors().find(std::to_string(first.pid())), std::string::npos);
}

TEST(NodeProcess, KilledAndStartedAgainItIsHeardAgain) {
  TestGraph graph;
  TestNode peer(graph, {{"count", "counter/out"}}, {});
  Latest<v1::Publication> count(peer.bus(), "count");
  peer.open();
  for (int round = 0; round < 5; ++round) {
    Process node(graph, kCounter, {});
    ASSERT_TRUE(peer.until([&] { return count.take() != nullptr; })) << node.errors();
    node.signal(SIGKILL);
    ASSERT_TRUE(node.wait());
    const auto killed = TestNode::now();
    EXPECT_TRUE(peer.until([&] { return peer.bus().known_nodes().empty(); }));
    EXPECT_LT(to_seconds(TestNode::now() - killed), 0.5) << "the death was not noticed at once";
    count.take();
  }
}

TEST(NodeProcess, NoNetworkInterfaceIsNeeded) {  // not even the loopback one is up
  const std::string unshare = "/usr/bin/unshare";
  const std::string flags = geteuid() == 0 ? "-n" : "-rn";
  if (access(unshare.c_str(), X_OK) != 0 || Process(unshare, {flags, "true"}).wait() != 0) {
    GTEST_SKIP() << "not here: unshare is not permitted";
  }
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  Process inside(unshare, {flags, self, "--gtest_filter=*MessagesReachIt*:*HeardAgain*"});
  EXPECT_EQ(inside.wait(60s), 0) << inside.output() << inside.errors();
  EXPECT_NE(inside.output().find("[  PASSED  ] 2 tests"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::runtime
