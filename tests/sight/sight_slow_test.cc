#include <gtest/gtest.h>

#include <cstdio>

#include "tests/sight/demonstration.h"

namespace mimesis {
namespace {

TEST(SightSlow, TellsAllEightDemonstrationsUnderAllConditions) {
  int shown = 0, right = 0, abstained = 0, flips = 0;
  constexpr std::uint64_t kSeed = 101;
  for (const Conditions& c : all_conditions()) {
    for (int k = 0; k < 8; ++k, ++shown) {
      const Verdict v =
          watch(picture_of(demonstration(k), c, kSeed + static_cast<std::uint64_t>(shown)));
      EXPECT_TRUE(v.right()) << c.what << ", demonstration " << k << ": grip " << v.grip
                             << " transport " << v.transport << " goal " << v.goal << " color "
                             << v.color << " complete " << v.complete;
      right += v.right() ? 1 : 0;
      abstained += v.abstained;
      flips += v.flips;
    }
  }
  std::printf("%d of %d demonstrations right; %d pictures without a vote for the grip\n", right,
              shown, abstained);
  EXPECT_GE(100 * right, 99 * shown);
  EXPECT_EQ(flips, 0);
}

}  // namespace
}  // namespace mimesis
