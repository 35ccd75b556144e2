// kill -9 of the recorder at random moments under load. MIMESIS_KILLS: how often (5); the slow test
// log_record_kill_campaign does it 200 times.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "tools/mimesis/log/test/record_fixture.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

/// A topic and when each of its messages was sent.
struct Stream {
  Stream(testing::TestNode& node, const std::string& port, std::size_t message_size)
      : out(node.bus(), port), topic("load/" + port), size(message_size) {}
  void send(const std::string& text) {
    v1::Publication m;
    m.set_topic(text.substr(times.size() % 100, size));
    times.push_back(Clock::now());
    out.send(m, testing::TestNode::now());
  }
  runtime::Out<v1::Publication> out;
  std::string topic;
  std::size_t size;
  std::vector<Clock::time_point> times;  ///< times of seq 1, 2, ...
};

/// 2000 small messages a second: chunks are closed by time. Heavy: with 1000 of 4 kB and 30 of 300
/// kB, which fill them before.
struct Load {
  explicit Load(const testing::TestGraph& graph)
      : node(graph, {}, {}, "load"),
        small(node, "small", 100),
        medium(node, "medium", 4000),
        large(node, "large", 300'000),
        text(noise(400'000, 7)) {
    node.open();
  }
  /// One millisecond of it.
  void advance() {
    next += 1ms;
    for (int i = 0; i < 2; ++i) small.send(text);
    if (heavy) medium.send(text);
    if (heavy && ++step % 33 == 0) large.send(text);
    node.until([this] { return Clock::now() >= next; });
  }
  testing::TestNode node;
  Stream small, medium, large;
  std::string text;
  std::uint64_t step = 0;
  bool heavy = true;
  Clock::time_point next = Clock::now();
};

/// How long before the kill the first message was sent that is not in the file.
Milliseconds missing(const LogContents& log, const Stream& stream, std::size_t sent_before_recorder,
                     Clock::time_point killed) {
  const auto found = log.seqs.find(stream.topic);
  std::size_t last = sent_before_recorder;
  if (found != log.seqs.end()) {
    const std::vector<std::uint32_t>& seqs = found->second;
    for (std::size_t i = 1; i < seqs.size(); ++i) {
      EXPECT_EQ(seqs[i], seqs[i - 1] + 1) << stream.topic << ": a hole";
    }
    last = seqs.back();
  }
  return last < stream.times.size() ? killed - stream.times[last] : Milliseconds(0);
}

class RecordKill : public RecordProcess {};

TEST_F(RecordKill, EveryFileOpensWithAllButTheLastTenthOfASecond) {
  const char* wanted = std::getenv("MIMESIS_KILLS");
  const int kills = wanted != nullptr ? std::atoi(wanted) : 5;
  std::mt19937 random(20261121);
  std::vector<double> lost_ms;
  std::uint64_t messages = 0, missing_messages = 0;
  Load load(graph_);
  for (int i = 0; i < kills; ++i) {
    const auto recorder = record({"--all", "--quiet"});
    load.next = Clock::now();
    load.heavy = i % 2 == 0;
    while (load.small.out.subscribers() == 0) load.advance();
    std::map<std::string, std::size_t> before;
    for (const Stream* s : {&load.small, &load.medium, &load.large})
      before[s->topic] = s->times.size();
    const int lifetime_ms = 200 + static_cast<int>(random() % 600);
    for (int ms = 0; ms < lifetime_ms; ++ms) load.advance();
    const auto killed = Clock::now();
    recorder->signal(SIGKILL);
    EXPECT_EQ(recorder->wait(), 128 + SIGKILL);

    const LogContents log(path("run.mcap"));
    ASSERT_TRUE(log.opens) << "kill " << i;
    Milliseconds worst{0};
    for (const Stream* s : {&load.small, &load.medium, &load.large}) {
      worst = std::max(worst, missing(log, *s, before[s->topic], killed));
      const auto found = log.seqs.find(s->topic);
      if (found == log.seqs.end()) continue;
      messages += found->second.size();
      missing_messages += s->times.size() - found->second.back();
    }
    lost_ms.push_back(worst.count());
  }
  std::ranges::sort(lost_ms);
  const auto quantile = [&](double q) {
    return lost_ms[static_cast<std::size_t>(q * static_cast<double>(lost_ms.size() - 1))];
  };
  const auto within = std::ranges::count_if(lost_ms, [](double ms) { return ms <= 100.0; });
  std::printf(
      "%d kills, %d files open; %llu messages recorded, %llu missing behind the end; time missing "
      "[ms]: min %.1f, median %.1f, p90 %.1f, p99 %.1f, max %.1f; <= 100 ms: %ld\n",
      kills, kills, static_cast<unsigned long long>(messages),
      static_cast<unsigned long long>(missing_messages), lost_ms.front(), quantile(0.5),
      quantile(0.9), quantile(0.99), lost_ms.back(), static_cast<long>(within));
  // The few kills of every test run only find a recorder that does not close chunks by time.
  EXPECT_LE(lost_ms.back(), wanted != nullptr ? 100.0 : 400.0);
}

}  // namespace
}  // namespace mimesis::tool
