#include "tools/mimesis/launch/watchdog.h"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "common/testing/process.h"

namespace mimesis::launch {
namespace {

using namespace std::chrono_literals;

TEST(Watchdog, OfAProcessThatComputesTheTimeCountsThatItHad) {
  const Activity before{'R', 10s};
  const auto silent = [&before](const Activity& now) {
    std::chrono::nanoseconds ahead{};
    return silence(100ms, before, now, ahead);
  };
  EXPECT_EQ(silent({'R', 10s + 30ms}), 30ms);
  EXPECT_EQ(silent({'R', 10s + 350ms}), 100ms) << "four threads";
  EXPECT_EQ(silent({'T', 10s + 30ms}), 100ms) << "stopped since then";
}

/// A process that sleeps and wakes waits for a processor at each waking. The kernel counts a wait
/// when it ends.
TEST(Watchdog, WaitsForAProcessorAreNoSilence) {
  std::chrono::nanoseconds ahead{};
  EXPECT_EQ(silence(100ms, {'S', 10s, 1s}, {'S', 10s, 1s}, ahead), 100ms);
  EXPECT_EQ(silence(100ms, {'S', 10s, 1s}, {'S', 10s, 1s + 80ms}, ahead), 20ms);
  // Silent for 60 ms; then it waits for 70 + 100 + 40 ms, sleeps for 50 and computes for 0.
  auto all = silence(100ms, {'R', 10s, 1s}, {'R', 10s + 30ms, 1s}, ahead);
  EXPECT_EQ(all, 30ms);
  all += silence(100ms, {'R', 10s + 30ms, 1s}, {'R', 10s + 30ms, 1s}, ahead);
  EXPECT_EQ(all, 30ms);
  all += silence(100ms, {'R', 10s + 30ms, 1s}, {'S', 10s + 40ms, 1s + 210ms}, ahead);
  EXPECT_EQ(all, 90ms);
  EXPECT_EQ(ahead, 0ms);
}

TEST(Watchdog, SeesWhatAProcessDoes) {
  const Activity before = activity(getpid());
  while (activity(getpid()).cpu < before.cpu + 50ms) {  // computes
  }
  EXPECT_EQ(activity(getpid()).state, 'R');
  EXPECT_EQ(activity(1 << 30).state, '?') << "no such process";
}

TEST(Watchdog, HearsSignsOfLifeAlone) {
  const testing::TestGraph graph;
  Watchdog watchdog(graph.directory());
  const std::string path = watchdog.environment("").at(0).second;
  EXPECT_TRUE(path.starts_with(graph.directory() + "/")) << "other users reach " << path;
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  path.copy(address.sun_path, path.size());
  const Fd sender(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  for (const std::string word : {"STATUS=x", "READY=1", "WATCHDOG=1", "WATCHDOG=10"}) {
    EXPECT_EQ(sendto(sender.get(), word.data(), word.size(), 0,
                     reinterpret_cast<const sockaddr*>(&address), sizeof address),
              static_cast<ssize_t>(word.size()));
  }
  for (const bool ready : {true, false}) {
    const auto sign = watchdog.next();
    ASSERT_TRUE(sign);
    EXPECT_EQ(sign->pid, getpid());
    EXPECT_EQ(sign->ready, ready);
  }
  EXPECT_FALSE(watchdog.next());
}

TEST(Activity, IsReadWhateverTheProcessIsCalled) {
  prctl(PR_SET_NAME, "x) T (y");
  EXPECT_EQ(activity(getpid()).text(), "it computes");
}

}  // namespace
}  // namespace mimesis::launch
