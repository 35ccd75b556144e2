// `mimesis log play` as a process, steered through its services.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "common/log/summary.h"
#include "common/log/writer.h"
#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "proto/foxglove/log.pb.h"
#include "proto/player.pb.h"
#include "proto/runtime.pb.h"

namespace mimesis::tool {
namespace {

using runtime::Reliable;
using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

constexpr std::uint64_t kSecond = 1'000'000'000, kBase = 1'700'000'000 * kSecond;
constexpr auto kPatience = 10s;

/// Writes messages (v1.Publication, told by its seq) of node `sender`.
class LogFile {
 public:
  explicit LogFile(const std::string& path) : sink_(*log::create_file(path)), writer_(*sink_, {}) {
    const auto& type = *v1::Publication::descriptor();
    schema_ = *writer_.add_schema(type.full_name(), "protobuf", runtime::descriptor_set(type));
  }
  void put(const std::string& topic, bool latched, std::uint32_t seq, double time_s,
           std::size_t padding = 0, std::optional<double> published_s = {}) {
    if (!channels_.contains(topic)) {
      channels_[topic] = *writer_.add_channel(
          schema_, topic, "protobuf",
          {{"node", "sender"}, {"latched", latched ? "true" : "false"}, {"start_id", "7"}});
    }
    v1::Publication m;
    m.set_seq(seq);
    m.set_topic(std::string(padding, 'x'));
    const auto ns = [](double s) { return kBase + static_cast<std::uint64_t>(s * 1e9); };
    ASSERT_TRUE(writer_.write({channels_[topic], seq, ns(time_s), ns(published_s.value_or(time_s)),
                               m.SerializeAsString()}));
  }
  /// A line of the sender.
  void say(double time_s, foxglove::Log::Level level, const std::string& text) {
    const auto& type = *foxglove::Log::descriptor();
    const auto schema =
        *writer_.add_schema(type.full_name(), "protobuf", runtime::descriptor_set(type));
    const auto channel =
        *writer_.add_channel(schema, "sender/log", "protobuf", {{"node", "sender"}});
    foxglove::Log line;
    line.set_level(level);
    line.set_name("sender");
    line.set_message(text);
    const std::uint64_t ns = kBase + static_cast<std::uint64_t>(time_s * 1e9);
    ASSERT_TRUE(writer_.write({channel, 1, ns, ns, line.SerializeAsString()}));
  }
  void close() { ASSERT_TRUE(writer_.finish()); }

 private:
  std::unique_ptr<log::Sink> sink_;
  log::Writer writer_;
  std::uint16_t schema_ = 0;
  std::map<std::string, std::uint16_t> channels_;
};

class LogPlay : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("MIMESIS_GRAPH", graph_.name().c_str(), 1);
    file_ = (folder_ / "run.mcap").string();
  }

  /// sender/count every 100 s from 0 to 900 s, the latched sender/state at 0 s and 400 s,
  /// sender/rare at 650 s: nothing moves unless it is asked to.
  void write_slow_log() {
    LogFile log(file_);
    for (std::uint32_t i = 0; i < 10; ++i) {
      if (i == 0) log.put("sender/state", true, 1, 0.0);
      log.put("sender/count", false, i + 1, 100.0 * i);
      if (i == 4) log.put("sender/state", true, 2, 400.0);
      if (i == 6) log.put("sender/rare", false, 1, 650.0);
    }
    log.close();
  }

  std::unique_ptr<Process> play(std::vector<std::string> options) const {
    std::vector<std::string> arguments{"log", "play", "--json", file_};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return std::make_unique<Process>("mimesis", arguments);
  }
  /// Plays until the player has found `node`, which is served meanwhile.
  std::unique_ptr<Process> play_to(TestNode& node, const std::vector<std::string>& options) const {
    auto process = play(options);
    EXPECT_TRUE(node.until([&] { return !status(node).holding(); })) << process->errors();
    return process;
  }

  template <class Request>
  static tl::expected<v1::PlayerStatus, Status> call(TestNode& node, const std::string& service,
                                                     const Request& request) {
    const auto answer = node.bus().call(service, request.SerializeAsString(), kPatience);
    if (!answer) return tl::unexpected(answer.error());
    v1::PlayerStatus status;
    EXPECT_TRUE(status.ParseFromString(*answer));
    return status;
  }
  static v1::PlayerStatus status(TestNode& node) {
    return call(node, "player/status", v1::PlayerAsk()).value_or(v1::PlayerStatus());
  }
  static v1::PlayerSeek to(double position_s) {
    v1::PlayerSeek seek;
    seek.set_position_s(position_s);
    return seek;
  }
  static v1::PlayerRate rate(double value) {
    v1::PlayerRate request;
    request.set_rate(value);
    return request;
  }

  TestGraph graph_;
  testing::TemporaryFolder folder_;
  std::string file_;
};

struct Listener {
  explicit Listener(const TestGraph& graph, const std::string& prefix = "sender/")
      : node(graph,
             {{"count", prefix + "count"}, {"state", prefix + "state"}, {"rare", prefix + "rare"}},
             {}),
        count(node.bus(), "count"),
        state(node.bus(), "state"),
        rare(node.bus(), "rare") {
    node.open();
  }
  /// seq of the next message; 0: none came.
  std::uint64_t next(Reliable<v1::Publication>& port) {
    const auto m = node.receive(port);
    return m ? m->seq() : 0;
  }
  TestNode node;
  Reliable<v1::Publication> count, state, rare;
};

TEST_F(LogPlay, StepsSeeksAndRunsOnAsItIsTold) {
  write_slow_log();
  Listener listener(graph_);
  const auto player = play_to(listener.node, {"--paused"});
  v1::PlayerStatus s = status(listener.node);
  EXPECT_TRUE(s.paused());
  EXPECT_EQ(s.messages(), 0U);
  EXPECT_EQ(s.position_s(), 0.0);
  EXPECT_EQ(s.end_s(), 900.0);

  s = *call(listener.node, "player/step", v1::PlayerStep());  // the answer tells of it already
  EXPECT_EQ(s.messages(), 1U);
  EXPECT_EQ(s.topic(), "sender/state");
  EXPECT_EQ(listener.next(listener.state), 1U);
  call(listener.node, "player/step", v1::PlayerStep());
  EXPECT_EQ(listener.next(listener.count), 1U);

  v1::PlayerStep to_rare;
  to_rare.set_topic("sender/rare");
  EXPECT_TRUE(call(listener.node, "player/step", to_rare));
  EXPECT_EQ(listener.next(listener.rare), 1U);
  for (std::uint64_t i = 2; i <= 7; ++i) EXPECT_EQ(listener.next(listener.count), i);
  EXPECT_EQ(listener.next(listener.state), 2U);
  s = status(listener.node);
  EXPECT_FALSE(s.stepping());
  EXPECT_EQ(s.position_s(), 650.0);
  EXPECT_EQ(s.messages(), 10U);

  s = *call(listener.node, "player/seek", to(350.0));  // the last state before comes at once
  EXPECT_EQ(s.position_s(), 350.0);
  EXPECT_TRUE(s.paused());
  EXPECT_EQ(listener.next(listener.state), 1U);
  call(listener.node, "player/step", v1::PlayerStep());
  EXPECT_EQ(listener.next(listener.count), 5U);
  v1::PlayerSeek back;
  back.set_offset_s(-1000.0);  // to the start at most
  EXPECT_EQ(call(listener.node, "player/seek", back)->position_s(), 0.0);
  v1::PlayerSeek at;
  at.set_log_time_ns(kBase + 500 * kSecond);
  EXPECT_EQ(call(listener.node, "player/seek", at)->position_s(), 500.0);
  EXPECT_EQ(listener.next(listener.state), 2U);

  EXPECT_EQ(call(listener.node, "player/rate", rate(1000.0))->rate(), 1000.0);
  EXPECT_FALSE(call(listener.node, "player/resume", v1::PlayerResume())->paused());
  for (std::uint64_t i = 6; i <= 10; ++i) EXPECT_EQ(listener.next(listener.count), i);
  EXPECT_EQ(player->wait(), 0) << player->errors();
  const auto report = nlohmann::json::parse(player->output());
  EXPECT_EQ(report["messages"], 17);
  EXPECT_EQ(report["missed"], 0);
}

TEST_F(LogPlay, ItsTimeLineHasTheLinesThatNodesLogged) {
  {
    LogFile log(file_);
    log.put("sender/count", false, 1, 0.0);
    log.say(1.5, foxglove::Log::INFO, "begins");
    log.say(200.0, foxglove::Log::WARNING, "is late");
    log.put("sender/count", false, 2, 900.0);
    log.close();
  }
  Listener listener(graph_);
  const auto player = play_to(listener.node, {"--paused"});
  v1::PlayerMarks marks;
  ASSERT_TRUE(listener.node.until([&] {
    const auto answer = listener.node.bus().call("player/marks", "", kPatience);
    return answer && marks.ParseFromString(*answer) && marks.whole();
  }));
  ASSERT_EQ(marks.marks_size(), 2);
  EXPECT_EQ(marks.marks(0).text(), "begins");
  EXPECT_EQ(marks.marks(1).position_s(), 200.0);
  EXPECT_EQ(marks.marks(1).level(), 3U);
  EXPECT_EQ(marks.marks(1).node(), "sender");
}

TEST_F(LogPlay, DrawsFieldsOfTheWholeLogAndSaysWhichThereAreNot) {
  write_slow_log();
  Listener listener(graph_);
  const auto player = play_to(listener.node, {"--paused"});
  v1::PlayerCurvesAsk ask;
  for (const char* path : {"seq", "nothing", "seq["}) {
    ask.add_fields()->set_topic("sender/count");
    ask.mutable_fields()->rbegin()->set_path(path);
  }
  ask.set_to_s(1000.0);
  ask.set_columns(100);
  v1::PlayerCurves all;
  ASSERT_TRUE(listener.node.until([&] {
    const auto answer =
        listener.node.bus().call("player/curves", ask.SerializeAsString(), kPatience);
    return answer && all.ParseFromString(*answer) && all.curves_size() == 3 &&
           all.curves(0).whole();
  }));
  const v1::PlayerCurve& seq = all.curves(0);
  EXPECT_EQ(seq.problem(), "");
  ASSERT_GT(seq.value_size(), 5);
  for (int i = 0; i < seq.value_size(); ++i) EXPECT_EQ(seq.value(i), i + 1) << seq.position_s(i);
  EXPECT_NE(all.curves(1).problem().find("nothing"), std::string::npos);
  EXPECT_NE(all.curves(2).problem(), "");
}

TEST_F(LogPlay, ARunningPlayerPausesWhereItIs) {
  write_slow_log();
  Listener listener(graph_);
  const auto player = play({"--rate", "1000"});
  EXPECT_EQ(listener.next(listener.count), 1U);
  v1::PlayerStatus s = *call(listener.node, "player/pause", v1::PlayerPause());
  EXPECT_TRUE(s.paused());
  const std::uint64_t position_ns = s.log_time_ns();
  s = status(listener.node);
  EXPECT_EQ(s.log_time_ns(), position_ns);  // time stands
  const std::uint64_t played = s.messages();
  EXPECT_EQ(status(listener.node).messages(), played);
  EXPECT_EQ(call(listener.node, "player/step", v1::PlayerStep())->messages(), played + 1);
  EXPECT_EQ(player->terminate(), 130) << player->errors();
}

TEST_F(LogPlay, WishesThatCannotBeFulfilledSayWhy) {
  write_slow_log();
  Listener listener(graph_);
  const auto player =
      play_to(listener.node, {"--paused", "--start", "100", "--end", "800", "--stay"});
  const auto refused = [&](const std::string& service, const auto& request) {
    const auto answer = call(listener.node, "player/" + service, request);
    return answer ? "accepted" : answer.error().reason;
  };
  EXPECT_EQ(refused("seek", to(99.0)),
            "99.000000000 s is outside of what is played: 100.000000000 to 800.000000000 s");
  EXPECT_EQ(refused("seek", to(-1.0)), "position_s is below 0");
  EXPECT_EQ(refused("seek", to(std::nan(""))), "position_s is not a number");
  EXPECT_EQ(refused("seek", v1::PlayerSeek()), "say where: position_s, offset_s or log_time_ns");
  EXPECT_EQ(refused("rate", rate(0.0)), "rate 0 is outside [0.001, 1000]");
  EXPECT_EQ(refused("rate", rate(std::nan(""))), "rate nan is outside [0.001, 1000]");
  v1::PlayerStep elsewhere;
  elsewhere.set_topic("sender/none");
  EXPECT_EQ(refused("step", elsewhere), "topic sender/none is not played");
  EXPECT_EQ(listener.node.bus().call("player/seek", "\xff", kPatience).error().reason,
            "not a mimesis.v1.PlayerSeek");

  EXPECT_TRUE(call(listener.node, "player/seek", to(800.0)));
  EXPECT_TRUE(call(listener.node, "player/step", v1::PlayerStep()));
  EXPECT_EQ(listener.next(listener.count), 9U);
  EXPECT_EQ(refused("step", v1::PlayerStep()), "the log is at its end");
  EXPECT_TRUE(status(listener.node).at_end());
  call(listener.node, "player/resume", v1::PlayerResume());
  ASSERT_TRUE(listener.node.until([&] { return status(listener.node).paused(); }));  // it stays
  EXPECT_TRUE(call(listener.node, "player/seek", to(700.0)));
  EXPECT_TRUE(call(listener.node, "player/step", v1::PlayerStep()));
  EXPECT_EQ(listener.next(listener.count), 8U);
  player->signal(SIGINT);
  EXPECT_EQ(player->wait(), 130);
}

TEST_F(LogPlay, UnderOtherNamesAndInLoops) {
  write_slow_log();
  Listener listener(graph_, "old/sender/");
  const auto player = play({"--remap", "sender/:=old/sender/", "--name", "again", "--rate", "1000",
                            "--loop", "2", "--start", "500", "--exclude", "sender/rare"});
  for (int pass = 0; pass < 2; ++pass) {
    EXPECT_EQ(listener.next(listener.state), 2U);
    for (std::uint64_t i = 6; i <= 10; ++i) EXPECT_EQ(listener.next(listener.count), i);
  }
  EXPECT_EQ(player->wait(), 0) << player->errors();
  const auto report = nlohmann::json::parse(player->output());
  EXPECT_EQ(report["messages"], 10);
  EXPECT_EQ(report["passes"], 2);
}

TEST_F(LogPlay, DrivesTheClockOfASimulatedGraph) {
  write_slow_log();
  TestNode node(graph_, {{"time", "clock/time"}, {"steps", "counter/out"}}, {});
  Reliable<v1::ClockTime> time(node.bus(), "time");
  Reliable<v1::Publication> steps(node.bus(), "steps");
  node.open();
  const Process counter(graph_, MIMESIS_COUNTER, {"--clock", "sim"});
  const auto player = play_to(node, {"--clock", "--paused"});
  // The first clock message for which `good` holds.
  const auto told = [&](const std::function<bool(const v1::ClockTime&)>& good) {
    std::optional<v1::ClockTime> m;
    do m = node.receive(time);
    while (m && !good(*m));
    return m.has_value();
  };
  const auto stands_at = [](double position_s) {
    return [=](const v1::ClockTime& m) {
      return m.factor() > 0.0 && m.factor() < 1e-5 &&
             m.time_ns() == kBase + static_cast<std::uint64_t>(position_s) * kSecond;
    };
  };
  EXPECT_TRUE(told(stands_at(0.0)));
  v1::PlayerStep step;
  step.set_topic("sender/rare");
  EXPECT_TRUE(call(node, "player/step", step));
  EXPECT_TRUE(told(stands_at(650.0)));
  EXPECT_TRUE(call(node, "player/seek", to(300.0)));
  EXPECT_TRUE(told(stands_at(300.0)));
  EXPECT_TRUE(call(node, "player/rate", rate(4.0)));
  EXPECT_TRUE(call(node, "player/resume", v1::PlayerResume()));
  EXPECT_TRUE(told([](const v1::ClockTime& m) {
    return m.factor() == 4.0 && m.time_ns() > kBase + 300 * kSecond;
  }));
  ASSERT_TRUE(node.receive(steps));  // a node that node_runs in this time steps
  const v1::PlayerStatus s = *call(node, "player/pause", v1::PlayerPause());
  EXPECT_TRUE(told(
      [&](const v1::ClockTime& m) { return m.factor() < 1e-5 && m.time_ns() == s.log_time_ns(); }));
  EXPECT_EQ(player->terminate(), 130);
}

TEST_F(LogPlay, PartsOfARecordingAreOneLog) {
  const std::string second = (folder_ / "second.mcap").string();
  {
    LogFile log(file_);
    log.put("sender/state", true, 1, 0.0);
    log.put("sender/count", false, 1, 0.001);
    log.close();
    LogFile next(second);
    next.put("sender/state", true, 1, 0.002, 0, 0.0);  // repeated by the recorder
    next.put("sender/count", false, 2, 0.003);
    next.put("sender/state", true, 2, 0.004);
    next.close();
  }
  Listener listener(graph_);
  const auto player = play({second});
  EXPECT_EQ(listener.next(listener.state), 1U);
  EXPECT_EQ(listener.next(listener.state), 2U);
  EXPECT_EQ(listener.next(listener.count), 1U);
  EXPECT_EQ(listener.next(listener.count), 2U);
  EXPECT_EQ(player->wait(), 0) << player->errors();
  EXPECT_EQ(nlohmann::json::parse(player->output())["messages"], 4);
}

TEST_F(LogPlay, ASlowReliableSubscriberLosesNothing) {
  constexpr std::uint32_t kMessages = 280;
  {
    LogFile log(file_);
    for (std::uint32_t i = 1; i <= kMessages; ++i) {
      log.put("sender/count", false, i, 2e-3 * i, 900'000);
    }
    log.close();
  }
  Listener listener(graph_);
  TestNode client(graph_, {}, {}, "client");
  client.open();
  const auto player = play_to(listener.node, {"--paused"});
  EXPECT_TRUE(call(client, "player/step", v1::PlayerStep()));
  ASSERT_EQ(listener.next(listener.count), 1U);
  EXPECT_TRUE(call(client, "player/resume", v1::PlayerResume()));
  // While it takes nothing, the player fills its buffers and then waits.
  ASSERT_TRUE(client.until([&] { return status(client).holding(); }));
  EXPECT_LT(status(client).messages(), kMessages);
  for (std::uint64_t i = 2; i <= kMessages; ++i) ASSERT_EQ(listener.next(listener.count), i);
  EXPECT_EQ(player->wait(), 0) << player->errors();
  const auto report = nlohmann::json::parse(player->output());
  EXPECT_GT(report["held_s"], 0.0);
  EXPECT_EQ(report["missed"], 0);
}

TEST_F(LogPlay, DamageIsReportedAndTheRestIsPlayed) {
  {
    LogFile log(file_);
    for (std::uint32_t i = 1; i <= 8; ++i) log.put("sender/count", false, i, 1e-3 * i, 500'000);
    log.close();
  }
  const auto source = log::open_file(file_);
  const auto summary = log::summarize(**source);
  ASSERT_EQ(summary->segments.size(), 3U);  // three, three and two
  const log::ChunkIndex& chunk = summary->segments[1].index;
  std::FILE* file = std::fopen(file_.c_str(), "r+b");
  std::fseek(file, static_cast<long>(chunk.chunk_start_offset + chunk.chunk_length / 2), SEEK_SET);
  std::fputs("damage", file);
  std::fclose(file);

  Listener listener(graph_);
  const auto player = play({});
  for (const std::uint64_t i : {1, 2, 3, 7, 8}) EXPECT_EQ(listener.next(listener.count), i);
  EXPECT_EQ(player->wait(), 1);
  EXPECT_NE(player->errors().find(
                fmt::format("{}: byte {}: chunk of log times", file_, chunk.chunk_start_offset)),
            std::string::npos)
      << player->errors();
}

/// As a bridge takes its commands.
TEST_F(LogPlay, PlaysToAnInputThatObeysTheRecordedNodeInItsPlaceOnly) {
  {
    LogFile log(file_);
    for (std::uint32_t i = 1; i <= 3; ++i) log.put("sender/count", false, i, 1e-3 * i);
    log.put("sender/rare", false, 1, 4e-3);
    log.close();
  }
  TestNode bridge(graph_, {{"count", "sender/count"}}, {}, "bridge");
  runtime::Latest<v1::Publication> count(bridge.bus(), "count", {.author = runtime::Author::named});
  bridge.open();
  const auto played = [&](const std::vector<std::string>& options, int code) {
    const auto player = play(options);
    EXPECT_TRUE(bridge.until([&] { return player->wait(0ms).has_value(); }));
    EXPECT_EQ(player->wait(), code) << player->errors();
    return player->errors();
  };
  const std::string refused =
      "nothing is published: sender/count (it is taken from node sender alone; heard by bridge). "
      "--into-live TOPIC ";
  EXPECT_NE(played({}, 2).find(refused), std::string::npos);
  played({"--exclude", "sender/count"}, 0);
  EXPECT_EQ(count.get(), nullptr);
  played({"--name", "sender"}, 0);
  ASSERT_NE(count.get(), nullptr);
  EXPECT_EQ(count.get()->seq(), 3U);

  Process clock(graph_, "mimesis_clock", {"--set", "participants=player"});
  ASSERT_TRUE(clock.wait_ready(graph_, "clock")) << clock.errors();
  EXPECT_NE(played({"--lockstep"}, 2).find(refused), std::string::npos);
  EXPECT_EQ(clock.terminate(), 0);
}

TEST_F(LogPlay, MistakesAreOneLineAndAnExitCode) {
  write_slow_log();
  const auto run = [](std::vector<std::string> arguments, int code, const std::string& says) {
    arguments.insert(arguments.begin(), {"log", "play"});
    Process process("mimesis", arguments);
    EXPECT_EQ(process.wait(), code) << process.errors();
    EXPECT_NE(process.errors().find(says), std::string::npos) << process.errors();
  };
  run({file_, "/no/second.mcap"}, 3, "cannot open '/no/second.mcap'");
  run({file_, "--remap", "a=b"}, 2, "--remap 'a=b': expected OLD:=NEW");
  run({file_, "--remap", "sender/cuont:=x"}, 2, "has no such topic");
  run({file_, "--topic", "sender/cuont"}, 2, "none of its topics is selected");
  run({file_, "--start", "901"}, 2, "nothing of its 900.000 s lies between");
  run({file_, "--end", "3", "--duration", "3"}, 2, "--duration");
  run({file_, "--rate", "1001"}, 2, "--rate");
  run({file_, "--lockstep", "--paused"}, 2, "--paused");
  run({file_, "--read-ahead", "0"}, 2, "expected a number above 0, found '0'");
  run({file_, "--remap", "sender/count:=a b"}, 2, "a b");
}

}  // namespace
}  // namespace mimesis::tool
