#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/testing/no_malloc.h"
#include "nodes/crowd/run/watch.h"

namespace mimesis::crowd {
namespace {

using Discs = std::vector<Closeness::Disc>;

TEST(Closeness, TellsGapAndDistance) {
  Closeness near;
  near.observe(Discs{{1, 0.0, 0.0, 0.3}, {2, 3.0, 4.0, 0.5}, {3, 90.0, 0.0, 9.0}});
  EXPECT_DOUBLE_EQ(near.least_distance_m(), 5.0);
  EXPECT_DOUBLE_EQ(near.least_gap_m(), 4.2);
  EXPECT_EQ(near.collisions(), 0u);
  near.observe(Discs{{1, 0.0, 0.0, 0.3}, {2, 30.0, 4.0, 0.5}});
  EXPECT_DOUBLE_EQ(near.least_gap_m(), 4.2) << "since the start";
}

TEST(Closeness, CountsOverlapsThatBegin) {
  Closeness near;
  const auto at = [&](double x) { near.observe(Discs{{7, x, 0.0, 0.25}, {4, 0.0, 0.0, 0.25}}); };
  at(0.6), at(0.49), at(0.3), at(0.45);
  EXPECT_EQ(near.collisions(), 1u) << "one that lasts";
  ASSERT_EQ(near.overlapping().size(), 1u);
  EXPECT_EQ(near.overlapping()[0], (std::pair<AgentId, AgentId>(4, 7)));
  at(0.8), at(0.4);
  EXPECT_EQ(near.collisions(), 2u);
  EXPECT_NEAR(near.least_gap_m(), -0.2, 1e-12);
}

TEST(Closeness, ATouchIsNoOverlap) {
  Closeness near;
  near.observe(Discs{{1, 0.0, 0.0, 0.25}, {2, 0.4995, 0.0, 0.25}});
  EXPECT_EQ(near.collisions(), 0u);
}

TEST(Closeness, FindsWhatAllPairsHave) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> place(0.0, 40.0), radius(0.1, 0.6);
  Closeness near;
  double gap = 1e9, distance = 1e9;
  std::size_t overlaps = 0;
  for (int round = 0; round < 20; ++round) {
    Discs discs;
    for (AgentId id = 1; id <= 200; ++id) {
      discs.push_back({id, place(engine), place(engine), radius(engine)});
    }
    overlaps = 0;
    for (std::size_t i = 0; i < discs.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double apart = std::hypot(discs[i].x_m - discs[j].x_m, discs[i].y_m - discs[j].y_m);
        const double between = apart - discs[i].radius_m - discs[j].radius_m;
        gap = std::min(gap, between);
        distance = std::min(distance, apart);
        overlaps += between < -1e-3;
      }
    }
    near.observe(discs);
    EXPECT_EQ(near.overlapping().size(), overlaps);
    EXPECT_NEAR(near.least_gap_m(), gap, 1e-9);
    EXPECT_NEAR(near.least_distance_m(), distance, 1e-9);
  }
  EXPECT_GT(overlaps, 0u);
}

/// The first look has no pair to go by: few and many, in a row, a square, and of other sizes.
TEST(Closeness, FindsTheNearestAtTheFirstLook) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> place(0.0, 1.0), radius(0.0, 3.0);
  for (int round = 0; round < 400; ++round) {
    const int n = 2 + round % 30;
    const double wide = round % 3 == 0 ? 0.0 : 50.0;
    Discs discs;
    double gap = 1e9, distance = 1e9;
    for (int i = 0; i < n; ++i) {
      discs.push_back({static_cast<AgentId>(i + 1), 50.0 * place(engine), wide * place(engine),
                       round % 2 == 0 ? 0.2 : radius(engine)});
      for (int j = 0; j < i; ++j) {
        const Closeness::Disc &a = discs.back(), &b = discs[static_cast<std::size_t>(j)];
        distance = std::min(distance, std::hypot(a.x_m - b.x_m, a.y_m - b.y_m));
        gap = std::min(gap, std::hypot(a.x_m - b.x_m, a.y_m - b.y_m) - a.radius_m - b.radius_m);
      }
    }
    Closeness near;
    near.observe(discs);
    EXPECT_NEAR(near.least_distance_m(), distance, 1e-9) << n;
    EXPECT_NEAR(near.least_gap_m(), gap, 1e-9) << n;
  }
}

TEST(Closeness, DoesNotAllocateOnceItHasRun) {
  Closeness near;
  Discs discs;
  for (AgentId id = 1; id <= 500; ++id) {
    discs.push_back({id, std::fmod(7.1 * static_cast<double>(id), 20.0),
                     std::fmod(3.3 * static_cast<double>(id), 20.0), 0.3});
  }
  near.observe(discs);
  near.observe(discs);
  mimesis::testing::NoMalloc guard;
  near.observe(discs);
}

}  // namespace
}  // namespace mimesis::crowd
