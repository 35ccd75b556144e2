// `result:`, and what a run leaves.
#include <sys/socket.h>
#include <sys/un.h>

#include "tools/mimesis/launch/test/launch_fixture.h"

namespace mimesis::launch {
namespace {

TEST_F(Launch, ResultIsTheLastLine) {
  auto launch =
      start("nodes:\n  a: {exec: " + undescribed() +
            ", params: {rate_hz: 100}}\nresult:\n  until: a/out\n  success: a/out.seq\n  fields:\n"
            "    topic: a/out.topic\n    seq: {from: a/out.seq, scale: 0.5, digits: 1}\n");
  EXPECT_EQ(launch->wait(), 1);  // a/out.seq is not `true`
  const json line = last_line(*launch);
  EXPECT_EQ(line["topic"], "counter");
  EXPECT_EQ(line["seq"], false);  // the success field says whether the run succeeded
  EXPECT_TRUE(line.contains("wall_s") && line.contains("graph_s"));
  EXPECT_EQ(line["log"], folder_.path() + "/mimesis/log/run");
}

TEST_F(Launch, ResultWithoutConditionSucceedsWithTheFirstMessage) {
  auto launch =
      start("nodes:\n  a: {exec: " + counter_ +
            "}\nresult: {until: a/out, fields: {n: {from: a/out.seq, scale: 0.5, digits: 1}}}\n");
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  const json line = last_line(*launch);
  EXPECT_EQ(line["n"], 0.5);  // the first message: none was lost
  EXPECT_EQ(line["success"], true);
}

TEST_F(Launch, ResultTellsOfTheDeathOfTheSupervisor) {
  auto launch = start("nodes:\n  a: {exec: " + undescribed() +
                      "}\nresult: {until: a/other, fields: {n: a/out.seq}}\n");
  ASSERT_TRUE(until([&] { return pids().contains("a"); }));
  kill(parent(pids().at("a")), SIGKILL);
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(last_line(*launch)["success"], false);
  EXPECT_EQ(last_line(*launch)["reason"], "the launcher was killed by SIGKILL");
}

TEST_F(Launch, ALogThatIsNotWholeIsAFailure) {
  auto launch = start(recorded(""));
  pid_t recorder = 0;
  ASSERT_TRUE(until([&] {
    const auto all = pids();
    for (const auto& [name, pid] : all) recorder = name.starts_with("tap-") ? pid : recorder;
    return recorder != 0 && all.contains("a");
  })) << launch->errors();
  kill(recorder, SIGKILL);
  ASSERT_TRUE(until([&] { return !alive(recorder); }));
  folder_.write("go", "");
  EXPECT_EQ(launch->wait(), 1) << launch->errors();
  EXPECT_EQ(
      summary(*launch)["reason"],
      "node 'end' ended with exit code 0; the log is not whole: node 'r' was killed by SIGKILL");

  std::filesystem::remove(folder_.path() + "/go");
  launch = start(recorded(", --min-free, 99.9%"));
  ASSERT_TRUE(until([&] {
    return launch->errors().find("node 'r' ended with exit code 1") != std::string::npos;
  })) << launch->errors();
  folder_.write("go", "");
  EXPECT_EQ(launch->wait(), 1) << launch->errors();
  EXPECT_NE(summary(*launch)["reason"].get<std::string>().find(
                "the log is not whole: node 'r' ended with exit code 1: recording stopped: "),
            std::string::npos);
}

TEST_F(Launch, RemovesWhatAKilledRunHasLeftAndNothingOfALivingNode) {
  const std::string folder = graph_.directory();
  const testing::Process live(graph_, counter_, {"--name", "live"});
  ASSERT_TRUE(until([&] { return pids().contains("live"); }));
  const auto of_live = left_in_graph();
  EXPECT_EQ(of_live.size(), 6U);  // entry, lock, three sockets, wall_clock
  for (const char* file : {"/dead-1.s", "/dead-77.d", "/gone-2-3.r", "/clock.sock", "/nodes/dead",
                           "/nodes/.dead", "/nodes/.gone.new"}) {
    std::ofstream(folder + file) << "x";
  }
  auto launch = start("nodes:\n  a: {exec: " + counter_ + "}\n");
  ASSERT_TRUE(until([&] { return pids().contains("a"); }));
  EXPECT_EQ(left_in_graph().size(), 12U);  // before the first node starts; the launcher's socket
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
  EXPECT_EQ(left_in_graph(), of_live);
}

TEST_F(Launch, RemovesSocketsOfDevicesThatNobodyHasBound) {
  const std::filesystem::path folder = graph_.directory();
  const auto bound = [&](const std::string& name, int type) {
    const int fd = socket(AF_UNIX, type | SOCK_CLOEXEC, 0);
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    const std::string path = folder / name;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return fd;
  };
  for (const int dead : {bound("can-dead/1.0", SOCK_DGRAM), bound("dead.modbus", SOCK_STREAM)})
    close(dead);
  const int frames = bound("can-live/2.0", SOCK_DGRAM),
            requests = bound("live.modbus", SOCK_STREAM);
  auto launch = start("nodes:\n  a: {exec: " + counter_ + "}\n");
  ASSERT_TRUE(until([&] { return pids().contains("a"); }));
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
  EXPECT_EQ(left_in_graph(), (std::vector<std::string>{"2.0", "live.modbus"}));
  EXPECT_FALSE(std::filesystem::exists(folder / "can-dead"));
  EXPECT_TRUE(std::filesystem::exists(folder / "nodes"));
  close(frames), close(requests);
}

TEST_F(Launch, NobodyWaitsForTheLauncherOnceTheResultIsThere) {
  auto launch = start("clock: lockstep\nnodes:\n  a: {exec: " + counter_ +
                      ", required: true, params: {rate_hz: 1000}, stop: {order: last}}\n"
                      "  slow: {exec: sh, ready: started, args: [-c, \"trap 'sleep 1; exit 0' INT; "
                      "sleep 1000 & wait\"]}\nresult: {until: a/out}\n");
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  EXPECT_EQ(last_line(*launch)["success"], true) << "a was killed: " << launch->errors();
}

TEST_F(Launch, ResultTellsOfTheDeathOfANode) {
  auto launch = start("nodes:\n  a: {exec: " + undescribed() +
                      ", required: true, params: {fail_at_step: 3}}\n"
                      "result: {until: a/other, fields: {n: a/out.seq}}\n");
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(last_line(*launch)["success"], false);
  const std::string reason = last_line(*launch)["reason"];
  EXPECT_TRUE(reason.starts_with("a: step failed: asked to fail (at ")) << reason;
  EXPECT_TRUE(reason.ends_with("; node 'a' ended with exit code 1")) << reason;
}

TEST_F(Launch, ResultTellsOfTheTimeOut) {
  auto launch = start("nodes:\n  a: {exec: " + undescribed() +
                      "}\nresult: {until: a/other, timeout: 300ms, fields: {n: a/out.seq}}\n");
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_TRUE(std::string(last_line(*launch)["reason"])
                  .ends_with("nothing on a/other within 0.3 s of graph time"));
}

TEST_F(Launch, ResultFieldThatTheTypeLacksIsAMistakeOfTheFile) {
  auto launch = start("nodes:\n  a: {exec: " + undescribed() +
                      "}\nresult: {until: a/out, fields: {n: a/out.sq}}\n");
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_NE(last_line(*launch)["reason"].get<std::string>().find(
                "g.yaml:4:36: mimesis.v1.Publication has no "
                "field 'sq', did you mean 'seq'?"),
            std::string::npos)
      << last_line(*launch);
}

}  // namespace
}  // namespace mimesis::launch
