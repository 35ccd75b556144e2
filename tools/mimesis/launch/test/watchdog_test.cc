#include "tools/mimesis/launch/watchdog.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace mimesis::launch {
namespace {

using namespace std::chrono_literals;

TEST(Watchdog, OfAProcessThatComputesTheTimeCountsThatItHad) {
  const Activity before{'R', 10s};
  EXPECT_EQ(silence(100ms, before, {'R', 10s + 30ms}), 30ms);
  EXPECT_EQ(silence(100ms, before, {'R', 10s + 350ms}), 100ms) << "four threads";
  EXPECT_EQ(silence(100ms, before, {'T', 10s + 30ms}), 100ms) << "stopped since then";
  EXPECT_EQ(silence(100ms, {'S', 10s}, {'S', 10s}), 100ms);
}

TEST(Watchdog, SeesWhatAProcessDoes) {
  const Activity before = activity(getpid());
  while (activity(getpid()).cpu < before.cpu + 50ms) {  // computes
  }
  EXPECT_EQ(activity(getpid()).state, 'R');
  EXPECT_EQ(activity(1 << 30).state, '?') << "no such process";
}

}  // namespace
}  // namespace mimesis::launch
