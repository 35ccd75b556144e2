#include "nodes/crowd/ways/ways.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace mimesis::crowd {
namespace {

using Eigen::Vector2d;
constexpr double kClear_m = 0.3;

double length_of(Ways& ways, const Vector2d& from, const Vector2d& to) {
  return ways.length_m(from, to).value_or(-1.0);
}

TEST(Ways, AroundAWallAreTangentsAndAnArc) {
  const Wall wall{{0.0, -50.0}, {0.0, 2.0}};
  Ways ways({&wall, 1}, {}, kClear_m);
  // From (−4, 0) over the end (0, 2): two tangents to a circle and the arc between them.
  const double far = std::hypot(4.0, 2.0), tangent = std::sqrt(far * far - kClear_m * kClear_m);
  const double arc = 2.0 * (std::atan2(2.0, 4.0) + std::asin(kClear_m / far));
  const double exact = 2.0 * tangent + kClear_m * arc;
  const double found = length_of(ways, {-4.0, 0.0}, {4.0, 0.0});
  EXPECT_GE(found, exact - 1e-9);
  EXPECT_LE(found, exact + 0.08 * 2.0 * std::numbers::pi * kClear_m);
  EXPECT_TRUE(ways.sees({-4.0, 2.4}, {4.0, 2.4}));
  EXPECT_FALSE(ways.sees({-4.0, 2.2}, {4.0, 2.2}));
  EXPECT_FALSE(ways.sees({-4.0, 0.0}, {4.0, 0.0}));
}

TEST(Ways, AreNotHeldUpByWallsThatTheyOnlyPointAt) {
  const Wall wall{{0.0, 0.0}, {4.0, 4.0}};
  Ways ways({&wall, 1}, {}, kClear_m);
  EXPECT_TRUE(ways.sees({3.0, 0.0}, {3.0, 1.0}));
  EXPECT_FALSE(ways.sees({3.0, 0.0}, {3.0, 5.0}));
}

TEST(Ways, GoAroundPolygonsAndNeverThroughThem) {
  const Polygon house{{-2, -1, 2, -1, 2, 1, -2, 1}};
  EXPECT_TRUE(inside(house, {0.0, 0.0}));
  EXPECT_TRUE(inside(house, {2.0, 0.5}));
  EXPECT_FALSE(inside(house, {2.1, 0.0}));
  Ways ways({}, {&house, 1}, kClear_m);
  EXPECT_EQ(ways.bends(), 12);  // three at each corner, all outside
  const double found = length_of(ways, {-5.0, 0.5}, {5.0, 0.5});
  EXPECT_GT(found, 10.0);
  EXPECT_LT(found, 10.5);  // over the upper side, which is nearer
  EXPECT_GT(ways.next({-5.0, 0.5}, {5.0, 0.5})->y(), 1.0);
  EXPECT_LT(ways.next({-5.0, -0.5}, {5.0, -0.5})->y(), -1.0);
  EXPECT_EQ(ways.next({-5.0, 3.0}, {5.0, 3.0}), Vector2d(5.0, 3.0));
  EXPECT_FALSE(ways.next({-5.0, 0.0}, {0.0, 0.0}).has_value());  // to its inside
}

TEST(Ways, EndWhereTheyAreClosed) {
  std::vector<Wall> room{{{0, 0}, {4, 0}}, {{4, 0}, {4, 4}}, {{4, 4}, {0, 4}}, {{0, 4}, {0, 2.8}}};
  room.push_back({{0, 2.2}, {0, 0}});  // a gap of 0.6 m
  EXPECT_FALSE(Ways(room, {}, 0.36).next({2, 2}, {-4, 2}).has_value());
  EXPECT_TRUE(Ways(room, {}, 0.27).next({2, 1}, {-4, 2}).has_value());
}

TEST(Ways, WhoStandsAtAWallFindsItsWay) {
  const Wall wall{{0.0, -50.0}, {0.0, 2.0}};
  Ways ways({&wall, 1}, {}, kClear_m);
  EXPECT_TRUE(ways.next({-0.1, 0.0}, {0.1, 0.0}).has_value());
  EXPECT_GT(length_of(ways, {-0.1, 0.0}, {0.1, 0.0}), 4.0);
}

/// Each leg is free, and who follows them goes no farther than was said.
TEST(Ways, AreWalkedFreeOfWallsInRandomRooms) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> at(-8.0, 8.0), angle(0.0, 6.3);
  int walked = 0, bent = 0;
  for (int room = 0; room < 30; ++room) {
    std::vector<Wall> walls;
    for (int k = 0; k < 8; ++k) {
      const Vector2d from(at(random), at(random));
      const double a = angle(random);
      walls.push_back({from, from + 4.0 * Vector2d(std::cos(a), std::sin(a))});
    }
    Ways ways(walls, {}, kClear_m), nearer(walls, {}, 0.85 * kClear_m);
    for (int k = 0; k < 20; ++k) {
      Vector2d p(at(random), at(random));
      const Vector2d goal(at(random), at(random));
      const auto length = ways.length_m(p, goal);
      if (!length) continue;
      ++walked;
      double left = *length;
      for (int leg = 0; p != goal; ++leg) {
        ASSERT_LT(leg, 50);
        const auto next = ways.next(p, goal);
        ASSERT_TRUE(next.has_value());
        EXPECT_TRUE(nearer.sees(p, *next));
        left -= (*next - p).norm();
        bent += *next != goal;
        p = *next;
        EXPECT_LE(ways.length_m(p, goal).value_or(1e9), left + 1e-9);
      }
    }
  }
  EXPECT_GT(walked, 300);
  EXPECT_GT(bent, 100);
}

}  // namespace
}  // namespace mimesis::crowd
