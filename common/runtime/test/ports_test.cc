#include "common/runtime/ports.h"

#include <gtest/gtest.h>

#include "common/testing/loopback.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

using namespace std::chrono_literals;

constexpr Time kMaxAge = 100ms;

class LatestPort : public ::testing::Test {
 protected:
  bool fresh(Time now) { return port_.fresh(now, kMaxAge) != nullptr; }
  testing::Loopback bus_;
  Latest<v1::Publication> port_{bus_, "in"};
};

TEST_F(LatestPort, IsFreshForItsAge) {
  EXPECT_FALSE(fresh(1s));
  bus_.send("in", v1::Publication(), 1s);
  EXPECT_TRUE(fresh(1s + 40ms));
  EXPECT_TRUE(fresh(1s + kMaxAge));
  EXPECT_FALSE(fresh(1s + kMaxAge + 1ns));
}

TEST_F(LatestPort, AStampAheadDoesNotKeepASilentSenderFresh) {
  bus_.send("in", v1::Publication(), 1s + 60ms);
  EXPECT_TRUE(fresh(1s));
  EXPECT_TRUE(fresh(1s + kMaxAge));
  EXPECT_FALSE(fresh(1s + kMaxAge + 1ns)) << "counted from the first look";
  bus_.send("in", v1::Publication(), 12s);
  EXPECT_FALSE(fresh(2s)) << "farther ahead than the age";
  bus_.send("in", v1::Publication(), 2s + 10ms);
  EXPECT_TRUE(fresh(2s + 10ms)) << "what comes after it counts again";
}

TEST_F(LatestPort, StampsBeyondTheRangeOfTimeAreRejected) {
  for (const Time stamp : {Time::min(), Time(-1), Time(-3600s)}) {
    bus_.send("in", v1::Publication(), stamp);
    EXPECT_FALSE(fresh(1s));
  }
  EXPECT_EQ(bus_.counters("in").rejected, 3U);
  bus_.send("in", v1::Publication(), Time::max());
  EXPECT_FALSE(fresh(1s));
}

}  // namespace
}  // namespace mimesis::runtime
