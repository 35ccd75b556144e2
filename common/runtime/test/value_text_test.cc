#include "common/runtime/value_text.h"

#include <gtest/gtest.h>

namespace mimesis::runtime {
namespace {
using namespace std::chrono_literals;

TEST(ValueText, Durations) {
  EXPECT_EQ(to_duration("2s"), 2s);
  EXPECT_EQ(to_duration("500ms"), 500ms);
  EXPECT_EQ(to_duration("1.5 min"), 90s);
  EXPECT_EQ(to_duration("0s"), 0s);
  for (const char* bad : {"2", "s", "-1s", "2 sec", "1e30h", "", "nans", "1..5s"}) {
    EXPECT_FALSE(to_duration(bad)) << bad;
  }
}

TEST(ValueText, Numbers) {
  EXPECT_EQ(to_double("-2.5e-3"), -2.5e-3);
  EXPECT_EQ(to_double("+1"), 1.0);
  EXPECT_EQ(to_int("-0"), 0);
  EXPECT_EQ(to_int("0"), 0);
  for (const char* bad : {"", " 1", "1 ", "0x1", "1_0", "+-1", "inf", "1e400"}) {
    EXPECT_FALSE(to_double(bad)) << bad;
  }
  for (const char* bad : {"", "010", "-010", "1.0", "1e3", "+"}) EXPECT_FALSE(to_int(bad)) << bad;
}

}  // namespace
}  // namespace mimesis::runtime
