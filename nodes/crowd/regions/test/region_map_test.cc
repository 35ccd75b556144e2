#include <gtest/gtest.h>

#include <limits>

#include "common/error.h"
#include "nodes/crowd/regions/far_crowd.h"

namespace mimesis::crowd {
namespace {

TEST(RegionMap, CutsThePlaneIntoRowsOfColumns) {
  const RegionMap map({-1.0, 4.0}, {0.0});
  EXPECT_EQ(map.count(), 6);
  EXPECT_EQ(map.of({-9.0, -9.0}), 0);
  EXPECT_EQ(map.of({0.0, -0.1}), 1);
  EXPECT_EQ(map.of({1e6, -0.1}), 2);
  EXPECT_EQ(map.of({-1.5, 0.1}), 3);
  EXPECT_EQ(map.of({3.9, 50.0}), 4);
  EXPECT_EQ(map.of({4.1, 50.0}), 5);
}

TEST(RegionMap, APointOnACutBelongsToTheUpperSide) {
  const RegionMap map({1.0}, {2.0});
  EXPECT_EQ(map.of({1.0, 2.0}), 3);
  EXPECT_EQ(map.of({1.0, 1.9}), 1);
  EXPECT_EQ(map.of({0.9, 2.0}), 2);
}

TEST(RegionMap, WithoutCutsThereIsOneRegion) {
  const RegionMap map({}, {});
  EXPECT_EQ(map.count(), 1);
  EXPECT_EQ(map.of({-1e9, 1e9}), 0);
  EXPECT_EQ(map.outside_m(0, {-1e9, 1e9}), 0.0);
}

TEST(RegionMap, TellsHowFarAPointIsOutside) {
  const RegionMap map({0.0, 10.0}, {0.0});
  EXPECT_EQ(map.outside_m(1, {5.0, -3.0}), 0.0);
  EXPECT_DOUBLE_EQ(map.outside_m(1, {-2.0, -3.0}), 2.0);
  EXPECT_DOUBLE_EQ(map.outside_m(1, {12.5, -3.0}), 2.5);
  EXPECT_DOUBLE_EQ(map.outside_m(1, {13.0, 4.0}), 5.0);
  EXPECT_DOUBLE_EQ(map.outside_m(3, {1.0, 1.0}), 1.0);
}

TEST(RegionMap, KeepsAnAgentUntilItIsWellOutside) {
  const RegionMap map({0.0}, {});
  EXPECT_EQ(map.owner(0, {0.3, 0.0}, 0.5), 0);
  EXPECT_EQ(map.owner(0, {0.6, 0.0}, 0.5), 1);
  EXPECT_EQ(map.owner(1, {-0.3, 0.0}, 0.5), 1);
  EXPECT_EQ(map.owner(1, {-0.6, 0.0}, 0.5), 0);
  int owner = 0, changes = 0;  // along the cut, swaying
  for (int i = 0; i < 1000; ++i) {
    const int next = map.owner(owner, {0.4 * ((i % 2 == 0) ? 1.0 : -1.0), 0.1 * i}, 0.5);
    changes += next != owner;
    owner = next;
  }
  EXPECT_EQ(changes, 0);
}

TEST(RegionMap, RefusesCutsThatAreNone) {
  EXPECT_THROW(RegionMap({1.0, 1.0}, {}), ConfigError);
  EXPECT_THROW(RegionMap({}, {2.0, 1.0}), ConfigError);
  EXPECT_THROW(RegionMap({std::numeric_limits<double>::quiet_NaN()}, {}), ConfigError);
  try {
    RegionMap({}, {2.0, 1.0});
  } catch (const ConfigError& e) {
    EXPECT_STREQ(e.what(), "regions.y_m: expected cuts in ascending order, each a finite number");
  }
}

TEST(RegionMap, TheNearestThatIsThereInherits) {
  const RegionMap map({0.0, 10.0}, {0.0});  // 0 1 2 below, 3 4 5 above
  EXPECT_EQ(map.heir(4, {true, true, true, true, true, true}), 4);
  EXPECT_EQ(map.heir(4, {true, true, true, true, false, true}), 1) << "of three, the first";
  EXPECT_EQ(map.heir(4, {true, false, true, false, false, true}), 5);
  EXPECT_EQ(map.heir(5, {true, false, false, true, false, false}), 3) << "two columns, not three";
  EXPECT_EQ(map.heir(0, {false, false, false, false, false, true}), 5);
}

}  // namespace
}  // namespace mimesis::crowd
