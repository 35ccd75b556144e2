#include "common/parallel/team.h"

#include <gtest/gtest.h>

#include <vector>

#include "common/error.h"
#include "common/testing/no_malloc.h"

namespace mimesis::parallel {
namespace {

TEST(Team, RunsEveryTaskOnceWhateverTheNumberOfThreads) {
  for (const int threads : {1, 2, 5}) {
    Team team(threads);
    EXPECT_EQ(team.threads(), threads);
    for (const int count : {0, 1, 2, 1000}) {
      std::vector<int> calls(static_cast<std::size_t>(count), 0);
      for (int round = 0; round < 50; ++round) {
        testing::NoMalloc guard;
        team.run(count, [&](int i) { ++calls[static_cast<std::size_t>(i)]; });
      }
      for (const int n : calls) EXPECT_EQ(n, 50);
    }
  }
}

TEST(Team, WithoutOneTheCallerDoesAll) {
  std::vector<int> order;
  for_each(nullptr, 4, [&](int i) { order.push_back(i); });
  EXPECT_EQ(order, (std::vector<int>{0, 1, 2, 3}));
}

TEST(Team, NeedsAThread) { EXPECT_THROW(Team(0), ConfigError); }

}  // namespace
}  // namespace mimesis::parallel
