#include "common/runtime/zmq_bus.h"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <random>

#include "common/runtime/ports.h"
#include "common/runtime/registry.h"
#include "common/runtime/sockets.h"
#include "common/runtime/test/peers.h"
#include "common/runtime/wire.h"
#include "common/testing/process.h"
#include "common/testing/refusal.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;

struct Pair {
  TestGraph graph;
  TestNode sender{graph, {}, {{"out", "t/x"}}, "sender"};
  TestNode receiver{graph, {{"in", "t/x"}, {"second", "t/x"}}, {}, "receiver"};
};

TEST(ZmqBus, LatestKeepsTheNewestAndCountsTheRest) {
  Pair p;
  Out<v1::Publication> out(p.sender.bus(), "out");
  auto in = p.receiver.bus().subscribe("in", v1::Publication::default_instance(), {});
  auto unused = p.receiver.bus().subscribe("second", v1::Publication::default_instance(), {});
  p.sender.open();
  ASSERT_TRUE(both(p.sender, p.receiver, [&] { return out.subscribers() > 0; }));
  for (std::uint64_t i = 1; i <= 5; ++i) {
    auto m = numbered(i);
    out.send(m, Time(i));
  }
  ASSERT_TRUE(p.receiver.until([&] { return in->counters().received == 5; }));
  const auto got = in->pop();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->seq, 5U);
  EXPECT_EQ(got->stamp, Time(5));
  EXPECT_EQ(got->source, "sender");
  EXPECT_FALSE(in->pop());
  EXPECT_EQ(in->counters().dropped, 4U);
  EXPECT_EQ(in->counters().lost, 0U);
  EXPECT_EQ(unused->counters().received, 5U);
}

TEST(ZmqBus, KnowsWhichInputsItAwaits) {
  Pair p;
  Out<v1::Publication> out(p.sender.bus(), "out");
  Reliable<v1::Publication> in(p.receiver.bus(), "in");
  Reliable<v1::Publication> optional(p.receiver.bus(), "second", true);
  p.sender.open();
  ASSERT_TRUE(both(p.sender, p.receiver, [&] { return out.subscribers() > 0; }));
  ASSERT_EQ(p.receiver.bus().awaited().size(), 1U);
  auto m = numbered(1);
  out.send(m, Time(1));
  ASSERT_TRUE(p.receiver.until([&] { return in.pop().has_value(); }));
  EXPECT_TRUE(p.receiver.bus().awaited().empty());
}

TEST(ZmqBus, AQueueDropsTheOldest) {
  Pair p;
  Out<v1::Publication> out(p.sender.bus(), "out");
  auto in = p.receiver.bus().subscribe("in", v1::Publication::default_instance(),
                                       {.policy = Policy::queue, .depth = 3});
  auto rest = p.receiver.bus().subscribe("second", v1::Publication::default_instance(), {});
  p.sender.open();
  ASSERT_TRUE(both(p.sender, p.receiver, [&] { return out.subscribers() > 0; }));
  for (std::uint64_t i = 1; i <= 5; ++i) {
    auto m = numbered(i);
    out.send(m, Time(i));
  }
  ASSERT_TRUE(p.receiver.until([&] { return in->counters().received == 5; }));
  for (std::uint64_t expected = 3; expected <= 5; ++expected) EXPECT_EQ(in->pop()->seq, expected);
  EXPECT_FALSE(in->pop());
  EXPECT_EQ(in->counters().dropped, 2U);
}

TEST(ZmqBus, ALateJoinerGetsTheLatchedMessageOnce) {
  TestGraph graph;
  TestNode sender(graph, {}, {{"out", "t/x"}}, "sender");
  Out<v1::Publication> out(sender.bus(), "out", {.latched = true});
  sender.open();
  auto m = numbered(7);
  out.send(m, 1s);
  TestNode first(graph, {{"in", "t/x"}}, {}, "first");
  Reliable<v1::Publication> in_first(first.bus(), "in");
  std::optional<v1::Publication> got;
  ASSERT_TRUE(both(first, sender, [&] { return (got = in_first.pop()).has_value(); }));
  EXPECT_EQ(got->seq(), 7U);
  TestNode second(graph, {{"in", "t/x"}}, {}, "second");
  Reliable<v1::Publication> in_second(second.bus(), "in");
  ASSERT_TRUE(both(second, sender, [&] { return in_second.pop().has_value(); }));
  m = numbered(8);
  out.send(m, 2s);
  ASSERT_TRUE(first.until([&] { return (got = in_first.pop()).has_value(); }));
  EXPECT_EQ(got->seq(), 8U) << "the repetition for the second one must not show";
}

TEST(ZmqBus, ReliableKeepsWhatAStuckSubscriberDoesNotTake) {
  Pair p;
  Out<v1::Publication> out(p.sender.bus(), "out");
  auto in = p.receiver.bus().subscribe("in", v1::Publication::default_instance(),
                                       {.policy = Policy::reliable});
  auto rest = p.receiver.bus().subscribe("second", v1::Publication::default_instance(), {});
  p.sender.open();
  ASSERT_TRUE(both(p.sender, p.receiver, [&] { return out.subscribers() > 1; }));
  constexpr std::uint64_t kCount = 30'000;
  auto m = numbered(1);
  m.set_topic(std::string(100, 'x'));
  for (std::uint64_t i = 1; i <= kCount; ++i) {
    const auto before = std::chrono::steady_clock::now();
    out.send(m, Time(i));
    ASSERT_LT(std::chrono::steady_clock::now() - before, 1s) << "send blocked";
  }
  EXPECT_GT(p.sender.bus().backlog(), 1000U);
  std::uint64_t expected = 1;
  ASSERT_TRUE(both(p.sender, p.receiver, [&] {
    while (const auto got = in->pop()) {
      EXPECT_EQ(got->seq, expected);
      ++expected;
    }
    return expected > kCount;
  })) << expected;
  EXPECT_EQ(p.sender.bus().backlog(), 0U);
  EXPECT_EQ(p.sender.bus().overflow(), 0U);
  EXPECT_EQ(in->counters().lost, 0U);
  EXPECT_GT(rest->counters().lost, 0U) << "the lossy socket is small";
}

TEST(ZmqBus, AStuckSubscriberNeitherFillsTheMemoryNorStopsTheOthers) {
  TestGraph graph;
  TestNode sender(graph, {}, {{"out", "t/x"}}, "sender");
  TestNode stuck(graph, {{"in", "t/x"}}, {}, "stuck"), well(graph, {{"in", "t/x"}}, {}, "well");
  Out<v1::Publication> out(sender.bus(), "out");
  Reliable<v1::Publication> in_stuck(stuck.bus(), "in"), in_well(well.bus(), "in");
  Tap recorder(
      graph.name(), [](const std::string& topic) { return topic == "t/x"; }, Policy::reliable);
  stuck.until([] { return true; });
  sender.bus().wait(std::chrono::steady_clock::now());
  sender.open();
  ASSERT_TRUE(both(sender, well, [&] {
    stuck.bus().wait(std::chrono::steady_clock::now());
    recorder.next(0ms);  // meets the sender
    return out.subscribers() == 3;
  }));
  auto m = numbered(1), numbered_small = m;
  m.set_topic(std::string(1'000'000, 'x'));
  std::uint64_t received = 0;
  constexpr std::uint64_t kCount = 400;  // 400 MB: more than sockets and backlog take
  for (std::uint64_t i = 1; i <= kCount; ++i) {
    out.send(m, Time(i));
    ASSERT_LT(sender.bus().backlog(), 300U);
    ASSERT_TRUE(both(well, sender,
                     [&] {  // the fast subscriber keeps up
                       while (in_well.pop()) ++received;
                       return received + sender.bus().backlog() + 8 >= i;
                     }))
        << i << " received " << received << " backlog " << sender.bus().backlog() << " overflow "
        << sender.bus().overflow();
  }
  EXPECT_GT(sender.bus().overflow(), 0U);
  EXPECT_TRUE(both(well, sender, [&] {
    while (in_well.pop()) ++received;
    return received == kCount;
  })) << received;

  // The stuck ones, of which the recorder is one, read again: the next message shows them how many
  // they have missed.
  std::uint64_t sent = kCount, taken = 0, lost = 0, recorded = 0, newest = 0;
  const auto read_again = [&] {
    well.bus().drain();
    while (in_well.pop()) ++received;
    while (in_stuck.pop()) ++taken;
    for (; const auto tapped = recorder.next(0ms); ++recorded) newest = tapped->message.seq;
    lost = stuck.bus().report_inputs(Time(0)).at(0).lost();
    if ((lost == 0 || newest == recorded) && taken > 10) out.send(numbered_small, Time(++sent));
    return lost > 0 && taken + lost == sent && newest == sent && newest > recorded &&
           sender.bus().overflow() == lost + newest - recorded;
  };
  EXPECT_TRUE(both(stuck, sender, read_again))
      << "overflow " << sender.bus().overflow() << ", lost " << lost << ", taken " << taken
      << ", recorded " << recorded << " of " << sent;
  EXPECT_GT(lost, 1U);
}

TEST(ZmqBus, ANodeThatIsAskedToStopDoesNotWaitLongForAMessage) {
  TestGraph graph;
  TestNode silent(graph, {}, {{"out", "t/x"}}, "silent"), waiting(graph, {{"in", "t/x"}}, {}, "w");
  Out<v1::Publication> out(silent.bus(), "out");
  Reliable<v1::Publication> in(waiting.bus(), "in");
  silent.open();
  ASSERT_TRUE(both(silent, waiting, [&] { return out.subscribers() == 1; }));
  google::protobuf::RepeatedPtrField<v1::Publication> visible;
  visible.Add()->set_topic("t/x");
  visible.at(0).set_start_id(silent.bus().info().start_id());
  visible.at(0).set_seq(1);
  const int stop = eventfd(1, EFD_CLOEXEC);
  const auto begin = std::chrono::steady_clock::now();
  waiting.bus().deliver(1s, visible, stop);
  close(stop);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 3s) << "then the launcher kills it";
  EXPECT_EQ(waiting.bus().report_inputs(Time(0)).at(0).lost(), 1U);
}

TEST(ZmqBus, GapsAreCounted) {
  Pair p;
  Out<v1::Publication> out(p.sender.bus(), "out");
  auto in = p.receiver.bus().subscribe("in", v1::Publication::default_instance(), {});
  auto second = p.receiver.bus().subscribe("second", v1::Publication::default_instance(), {});
  p.sender.open();
  ASSERT_TRUE(both(p.sender, p.receiver, [&] { return out.subscribers() > 0; }));
  auto m = numbered(1);
  m.set_topic(std::string(100'000, 'x'));
  constexpr std::uint64_t kCount = 500;
  for (std::uint64_t i = 1; i <= kCount; ++i) out.send(m, Time(i));
  // The last one sent after the flood shows the gap before it.
  ASSERT_TRUE(p.receiver.until([&] {
    out.send(m, 1s);
    return in->counters().received + in->counters().lost > kCount;
  }));
  EXPECT_GT(in->counters().lost, 0U);
  EXPECT_GT(in->counters().received, 10U);
}

TEST(ZmqBus, LastWordsOfANodeThatStopsArrive) {
  for (int round = 0; round < 20; ++round) {
    Pair p;
    auto in = p.receiver.bus().subscribe("in", v1::Publication::default_instance(),
                                         {.policy = Policy::reliable});
    auto rest = p.receiver.bus().subscribe("second", v1::Publication::default_instance(), {});
    {
      TestNode brief(p.graph, {}, {{"out", "t/x"}}, "brief");
      Out<v1::Publication> out(brief.bus(), "out");
      brief.open();
      ASSERT_TRUE(both(brief, p.receiver, [&] { return out.subscribers() == 2; }));
      for (std::uint64_t i = 1; i <= 20; ++i) {
        auto m = numbered(i);
        out.send(m, Time(i));
      }
    }
    EXPECT_TRUE(p.receiver.until([&] { return in->counters().received == 20; }, 2s))
        << in->counters().received;
  }
}

TEST(ZmqBus, DifferentTypesAreReportedOnBothSidesByName) {
  Pair p;
  Out<v1::Publication> out(p.sender.bus(), "out");
  auto in = p.receiver.bus().subscribe("in", v1::Health::default_instance(), {});
  auto second = p.receiver.bus().subscribe("second", v1::Publication::default_instance(), {});
  ::testing::internal::CaptureStderr();
  p.sender.open();
  ASSERT_TRUE(both(p.sender, p.receiver, [&] {
    return p.sender.bus().known_nodes().size() == 1 && p.receiver.bus().known_nodes().size() == 1 &&
           out.subscribers() > 0;
  }));
  const std::string said = ::testing::internal::GetCapturedStderr();
  const std::string line =
      "topic t/x: node sender publishes mimesis.v1.Publication, node receiver expects "
      "mimesis.v1.Health";
  const std::size_t at = said.find(line);
  ASSERT_NE(at, std::string::npos) << said;
  EXPECT_NE(said.find(line, at + 1), std::string::npos) << "only one side said it: " << said;
  auto m = numbered(1);
  out.send(m, 1s);
  ASSERT_TRUE(p.receiver.until([&] { return second->counters().received == 1; }));
  EXPECT_FALSE(in->pop());
  EXPECT_EQ(in->counters().rejected, 1U);
}

TEST(ZmqBus, TwoGraphsDoNotMeet) {
  Pair p;
  TestGraph other;
  TestNode stranger(other, {{"in", "t/x"}}, {}, "receiver");
  Out<v1::Publication> out(p.sender.bus(), "out");
  auto in = p.receiver.bus().subscribe("in", v1::Publication::default_instance(), {});
  auto second = p.receiver.bus().subscribe("second", v1::Publication::default_instance(), {});
  auto strange = stranger.bus().subscribe("in", v1::Publication::default_instance(), {});
  p.sender.open();
  stranger.open();
  ASSERT_TRUE(both(p.sender, p.receiver, [&] { return out.subscribers() > 0; }));
  auto m = numbered(1);
  out.send(m, 1s);
  ASSERT_TRUE(both(stranger, p.receiver, [&] { return in->counters().received == 1; }));
  EXPECT_TRUE(stranger.bus().known_nodes().empty());
  EXPECT_EQ(strange->counters().received, 0U);
}

TEST(ZmqBus, AnInputOfANamedAuthorObeysTheNodeThatItsTopicNames) {
  Listener listener(Author::named);
  TestNode owner(listener.graph, {}, {{"out", "t/x"}}, "t");
  TestNode other(listener.graph, {}, {{"out", "t/x"}}, "other");
  Out<v1::Publication> from_owner(owner.bus(), "out"), from_other(other.bus(), "out");
  owner.open();
  other.open();
  ASSERT_TRUE(both(owner, other, [&] {
    listener.node.bus().wait(std::chrono::steady_clock::now());
    return from_owner.subscribers() > 0 && from_other.subscribers() > 0;
  }));
  ::testing::internal::CaptureStderr();
  auto m = numbered(1);
  for (int i = 0; i < 3; ++i) from_other.send(m, 1s);
  from_owner.send(m, 1s);
  EXPECT_EQ(listener.until(4), "1 ");
  EXPECT_EQ(listener.in->counters().rejected, 3U);
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("topic t/x: messages of node other, process "), std::string::npos) << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
}

TEST(ZmqBus, AnInputOfOneAuthorObeysThePublisherThatItIsTold) {
  TestGraph graph;
  BusOptions options{.name = "receiver",
                     .graph = graph.name(),
                     .in = {{"in", "arm/command"}},
                     .out = {},
                     .from = {{"in", "planner"}},
                     .bind = {}};
  ZmqBus receiver(options);
  auto in =
      receiver.subscribe("in", v1::Publication::default_instance(), {.author = Author::named});
  EXPECT_EQ(receiver.info().inputs(0).obeys(), "planner");
  TestNode planner(graph, {}, {{"out", "arm/command"}}, "planner");
  TestNode arm(graph, {}, {{"out", "arm/command"}}, "arm");
  Out<v1::Publication> from_planner(planner.bus(), "out"), from_arm(arm.bus(), "out");
  planner.open();
  arm.open();
  const auto served = [&](const auto& done) {
    return both(planner, arm, [&] {
      receiver.wait(std::chrono::steady_clock::now());
      receiver.drain();
      return done();
    });
  };
  ASSERT_TRUE(served([&] { return from_planner.subscribers() > 0 && from_arm.subscribers() > 0; }));
  auto m = numbered(1);
  from_planner.send(m, 1s);
  from_arm.send(m, 1s);
  ASSERT_TRUE(served([&] { return in->counters().received + in->counters().rejected == 2; }));
  EXPECT_EQ(in->pop()->source, "planner");
  EXPECT_FALSE(in->pop());

  options.name = "other";
  options.from["in"] = "planner,rival";
  ZmqBus other(options);
  EXPECT_NO_THROW(other.subscribe("any", v1::Publication::default_instance(), {}));
  EXPECT_THROW(
      other.subscribe("in", v1::Publication::default_instance(), {.author = Author::named}),
      ConfigError);
}

TEST(ZmqBus, AnInputOfTheFirstAuthorTakesTheNextAfterItsEnd) {
  Listener listener(Author::first);
  auto first = std::make_unique<TestNode>(listener.graph, TestNode::Wiring{},
                                          TestNode::Wiring{{"out", "t/x"}}, "first");
  auto from_first = std::make_unique<Out<v1::Publication>>(first->bus(), "out");
  first->open();
  const auto author = [&] { return listener.node.bus().info().inputs(0).obeys(); };
  ASSERT_TRUE(listener.node.until([&] { return author() == "first"; }));
  ASSERT_TRUE(both(*first, listener.node, [&] { return from_first->subscribers() > 0; }));

  // A second one is refused on both sides.
  ZmqBus strange({.name = "strange",
                  .graph = listener.graph.name(),
                  .in = {},
                  .out = {{"out", "t/x"}},
                  .bind = {}});
  const Out<v1::Publication> from_strange(strange, "out");
  try {
    strange.ready();
    ADD_FAILURE() << "it starts beside the author";
  } catch (const ConfigError& e) {
    EXPECT_STREQ(e.what(),
                 "node receiver takes topic t/x from node first alone: it refuses messages of node "
                 "strange");
  }
  TestNode second(listener.graph, {}, {{"out", "t/x"}}, "second");  // it insists
  Out<v1::Publication> from_second(second.bus(), "out");
  second.open();
  ASSERT_TRUE(both(second, listener.node, [&] { return from_second.subscribers() > 0; }));
  auto m = numbered(1);
  from_second.send(m, 1s);
  from_first->send(m, 1s);
  EXPECT_EQ(listener.until(2), "1 ");
  EXPECT_EQ(listener.in->counters().rejected, 1U);

  from_first.reset();
  first.reset();
  ASSERT_TRUE(listener.node.until([&] { return author() == "second"; }));
  from_second.send(m, 1s);
  EXPECT_EQ(listener.until(3), "2 ");
}

TEST(ZmqBus, AnInputOfOneAuthorAsksTheKernelWhoSpeaks) {
  Listener listener(Author::named);
  Liar liar(listener.graph, listener.endpoint, getppid());  // has the start id, is another process
  ASSERT_TRUE(listener.node.until([&] { return liar.send(1); }));
  EXPECT_EQ(listener.until(1), "");
}

TEST(ZmqBus, OneForgedNumberMakesNobodyDeaf) {
  Listener listener;
  Liar liar(listener.graph, listener.endpoint);
  ASSERT_TRUE(listener.node.until([&] { return liar.send(1); }));
  constexpr std::uint64_t kForged = std::uint64_t{1} << 63U;
  for (const std::uint64_t seq : {std::uint64_t{2}, kForged, std::uint64_t{3}}) liar.send(seq);
  EXPECT_EQ(listener.until(4), "1 2 3 ");
  EXPECT_EQ(listener.in->counters().rejected, 1U);
  EXPECT_EQ(listener.in->counters().lost, 0U);
  for (const std::uint64_t seq : {5000U, 5001U, 5002U}) liar.send(seq);  // it was not heard so long
  EXPECT_EQ(listener.until(7), "5001 5002 ");
  EXPECT_EQ(listener.in->counters().lost, 5001U - 4U);
  for (const std::uint64_t seq : {6U, 7U}) liar.send(seq);  // those were forged, all three
  EXPECT_EQ(listener.until(9), "7 ");
}

TEST(ZmqBus, AnEndpointThatIsNoneIsSaidAndSurvived) {
  Listener listener;
  ::testing::internal::CaptureStderr();
  const Liar liar(listener.graph, "garbage://x");
  EXPECT_TRUE(listener.node.until([&] { return !listener.node.bus().known_nodes().empty(); }));
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("cannot connect to garbage://x"), std::string::npos) << said;
}

TEST(ZmqBus, SubscriptionsHaveALimit) {
  Pair p;
  Out<v1::Publication> out(p.sender.bus(), "out");
  auto in = p.receiver.bus().subscribe("in", v1::Publication::default_instance(), {});
  p.sender.open();
  ASSERT_TRUE(both(p.sender, p.receiver, [&] { return out.subscribers() > 0; }));
  ::testing::internal::CaptureStderr();
  ZmqContext context;
  ZmqSocket greedy(context, ZMQ_SUB);
  greedy.set(ZMQ_SNDHWM, 0);
  for (int i = 0; i < 20'000; ++i)
    greedy.set(ZMQ_SUBSCRIBE, std::string(40, 'x') + std::to_string(i));
  greedy.connect(p.sender.bus().info().data_endpoints(0));
  EXPECT_TRUE(p.sender.until([&] { return p.sender.bus().malformed() > 0; }));
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("process " + std::to_string(getpid()) + " subscribes to more than"),
            std::string::npos)
      << said;
  EXPECT_EQ(std::ranges::count(said, '\n'), 1) << said;
  auto m = numbered(1);
  out.send(m, 1s);
  EXPECT_TRUE(p.receiver.until([&] { return in->counters().received == 1; }));
}

TEST(ZmqBus, BytesThatAreNoMessagesAreCounted) {
  TestGraph graph;
  TestNode receiver(graph, {{"in", "t/x"}}, {}, "receiver");
  auto in = receiver.bus().subscribe("in", v1::Publication::default_instance(), {});
  receiver.open();
  // A publisher that speaks ZeroMQ but not our frames, announced as a node.
  ZmqContext context;
  ZmqSocket liar(context, ZMQ_XPUB);
  const std::string endpoint = "ipc://" + graph.directory() + "/liar";
  liar.bind(endpoint);
  TestNode entry(graph, {}, {}, "entry");
  v1::NodeInfo info = entry.bus().info();
  *info.mutable_data_endpoints(0) = endpoint;
  v1::TopicInfo& output = *info.add_outputs();
  output.set_topic("t/x");
  output.set_type_hash(type_hash(*v1::Publication::descriptor()));
  RegistryEntry liars_entry(graph.directory(), "liar");
  info.set_name("liar");
  liars_entry.publish(info);
  Frame subscribed;
  ASSERT_TRUE(receiver.until([&] { return liar.receive(subscribed); }));
  std::mt19937 random(1);
  constexpr std::uint64_t kCount = 2000;
  std::uint64_t sent = 0;
  while (receiver.bus().malformed() < kCount / 2 && sent < 20 * kCount) {
    std::string bytes("t/x\0", 4);
    bytes.resize(4 + random() % 80);
    for (std::size_t i = 4; i < bytes.size(); ++i) bytes[i] = static_cast<char>(random());
    if (bytes.size() == 44) continue;  // a header has 44 bytes
    Frame first{std::string_view(bytes)}, second(std::size_t{random() % 10}), third(std::size_t{1});
    const auto parts = random() % 3;
    if (liar.send(first, parts > 0)) ++sent;
    if (parts > 0) liar.send(second, parts > 1);
    if (parts > 1) liar.send(third, false);
    receiver.until([] { return true; });
  }
  EXPECT_GE(receiver.bus().malformed(), kCount / 2);
  EXPECT_EQ(in->counters().received, 0U);
}

TEST(ZmqBus, BadNamesAndPlacesAreRefused) {
  TestGraph graph;
  EXPECT_THROW(TestNode(graph, {}, {}, ".hidden"), ConfigError);
  EXPECT_THROW(TestNode(graph, {{"in", "a//b"}}, {}), ConfigError);
  EXPECT_THROW(graph_directory("../elsewhere"), ConfigError);
  const std::string refused = testing::refusal([&] {
    const TestNode longest(graph, {}, {}, std::string(64, 'n'));
    const std::string long_graph(64, 'g');
    ZmqBus bus(
        {.name = std::string(64, 'n'), .graph = long_graph, .in = {}, .out = {}, .bind = {}});
  });
  EXPECT_NE(refused.find("107"), std::string::npos) << refused;
  ASSERT_EQ(chmod(graph.directory().c_str(), 0777), 0);
  EXPECT_THROW(TestNode(graph, {}, {}, "late"), ConfigError);
}

}  // namespace
}  // namespace mimesis::runtime
